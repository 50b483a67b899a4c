"""Initial states of the character, drawn from the clips or the rest pose."""

from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.config import InitialStates, WorldConfig
from world.errors import ClipError, ConfigError
from world.motions.library import Frames, MotionLibrary

#: Categories of initial states, by number.
KINDS = ("reference", "near", "far")
#: Initial height of a character above the clip's own, m: contacts begin unloaded.
LIFT_M = 0.002


@dataclass(frozen=True)
class CharacterStates:
    """Initial states of m characters in the world frames of their clips."""

    kind: Tensor
    """[m] int64: index into KINDS."""
    stage: Tensor
    """[m] int64: stage of a reference state (world.motions.uses.use)."""
    frame: Tensor
    """[m] int64: frame in the motion library; arbitrary for the rest pose."""
    frames: Frames
    """The frames themselves [m]."""
    rest: Tensor
    """[m] bool: the character is in the rest pose instead."""
    qpos: Tensor
    """[m, 43]."""
    qvel: Tensor
    """[m, 34]."""

    def above_origin(self) -> Tensor:
        """[m, 43]: qpos with the root above the world's origin, LIFT_M higher."""
        level = torch.zeros_like(self.qpos[:, :2])
        return torch.cat((level, self.qpos[:, 2:3] + LIFT_M, self.qpos[:, 3:]), dim=1)

    def named_frame(self) -> Tensor:
        """[m] int64: frame in the motion library, −1 for the rest pose."""
        return torch.where(self.rest, -1, self.frame)


class CharacterSampler:
    """Draws the initial states of characters."""

    def __init__(self, config: WorldConfig, library: MotionLibrary) -> None:
        """Raises as `require`."""
        initial = config.initial
        require(initial, library)
        fractions = [initial.reference, initial.near, initial.far]
        self._standing_fraction, self._library = initial.standing_fraction, library
        edges = torch.tensor(fractions, dtype=torch.float64).cumsum(0) / sum(fractions)
        self._edges = edges[:-1].to(torch.float32)
        stages = [
            fraction if len(pool) else 0.0
            for fraction, pool in zip(initial.reference_stages, library.start_stages, strict=True)
        ]
        self._stage_edges = (
            torch.tensor(stages, dtype=torch.float64).cumsum(0) / max(sum(stages), 1e-9)
        )[:-1].to(torch.float32)
        self._standing = torch.from_numpy(character.standing_qpos()).to(torch.float32)

    def draw(self, u: Tensor, close: Tensor | None = None) -> CharacterStates:
        """Return the states of uniform numbers u [m, 4 or more]: category, stage, frame, rest pose.

        close [m] bool: near states whose object is so close that a walking character would
        collide with it; these are drawn from slow frames.
        """
        library = self._library
        kind = torch.bucketize(u[:, 0].contiguous(), self._edges, right=True)
        from_clip = kind == 0
        stage = torch.bucketize(u[:, 1].contiguous(), self._stage_edges, right=True)
        frame = _pick(library.upright, u[:, 2])
        if close is not None and len(library.slow):
            frame = torch.where((kind == 1) & close, _pick(library.slow, u[:, 2]), frame)
        for s, pool in enumerate(library.start_stages):
            if len(pool):
                frame = torch.where(from_clip & (stage == s), _pick(pool, u[:, 2]), frame)
        frames = library.at(frame)
        rest = ~from_clip & (u[:, 3] < self._standing_fraction)
        qpos = torch.where(rest[:, None], self._standing, frames.qpos)
        qvel = torch.where(rest[:, None], torch.zeros_like(frames.qvel), frames.qvel)
        return CharacterStates(kind, stage, frame, frames, rest, qpos, qvel)


def require(initial: InitialStates, library: MotionLibrary) -> None:
    """Raise ConfigError for invalid fractions, ClipError where reference states are configured and
    no clip has the task's use."""
    fractions = [initial.reference, initial.near, initial.far]
    if min(fractions) < 0 or sum(fractions) <= 0:
        raise ConfigError(
            f"--world.initial.reference, near and far are {fractions}: each must be 0 or more,"
            " and not all 0"
        )
    if initial.reference > 0 and not any(len(stage) for stage in library.start_stages):
        raise ClipError(library.use.missing)


def course(qpos: Tensor, qvel: Tensor) -> Tensor:
    """Return unit vectors [m, 2]: the root's direction of motion, or its heading where it hardly
    moves."""
    speed = qvel[:, :2].norm(dim=1, keepdim=True)
    moving = qvel[:, :2] / speed.clamp_min(1e-6)
    return torch.where(speed > 0.3, moving, rotations.heading(qpos[:, 3:7]))


def unit(u: Tensor) -> Tensor:
    """Return the unit vectors [m, 2] at the angles 2π u."""
    angle = (2 * torch.pi) * u
    return torch.stack((torch.cos(angle), torch.sin(angle)), dim=1)


def _pick(pool: Tensor, u: Tensor) -> Tensor:
    return pool[(u.double() * len(pool)).long().clamp_max(len(pool) - 1)]
