"""How episodes start: from a clip's own state with its furniture, or upright with furniture
anywhere near.

A start is a pure function of (seed, scene, episode).
"""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from world import character, clearance, rotations, streams
from world.bank import Bank
from world.config import WorldConfig
from world.errors import ClipError, ConfigError
from world.motions.library import MotionLibrary

#: Names of the kinds of start, by number.
KINDS = ("clip", "near", "far")
#: How far above the clip's own height a character is set down, m: contacts start unloaded.
_LIFT_M = 0.002
#: Furniture of a clip's start: how far each candidate is pushed back, m, and how deep the character
#: may stand in it, m.
_PUSHED_BACK_M = (0.0, 0.0, 0.0, 0.04, 0.04, 0.08)
_TOLERATED_M = 0.015


@dataclass(frozen=True)
class Starts:
    """First states of m episodes, world frame, the character above the origin."""

    qpos: Tensor
    """[m, 43]."""
    qvel: Tensor
    """[m, 34]."""
    variant: Tensor
    """[m] int64: the furniture, by number in the bank."""
    point: Tensor
    """[m, 2]: the floor point below the place of use, m."""
    facing: Tensor
    """[m, 2]: cosine and sine of the place's facing."""
    kind: Tensor
    """[m] int64: index into KINDS."""
    frame: Tensor
    """[m] int64: the state's frame in the motion library; −1 for the rest pose."""


class Starter:
    """Draws the starts of a shard's episodes."""

    def __init__(self, config: WorldConfig, library: MotionLibrary, bank: Bank, seed: int) -> None:
        shares = [config.starts.clip, config.starts.near, config.starts.far]
        if min(shares) < 0 or sum(shares) <= 0:
            raise ConfigError(f"starts {shares}: shares must be 0 or more, and not all 0")
        if config.starts.clip > 0 and not any(len(stage) for stage in library.stages):
            raise ClipError("no clip uses a seat: set starts.clip to 0 or add clips that sit down")
        self._config, self._library, self._bank, self._seed = config, library, bank, seed
        edges = torch.tensor(shares, dtype=torch.float64).cumsum(0) / sum(shares)
        self._edges = edges[:-1].to(torch.float32)
        stages = [
            share if len(pool) else 0.0
            for share, pool in zip(config.clip_stages, library.stages, strict=True)
        ]
        self._stage_edges = (
            torch.tensor(stages, dtype=torch.float64).cumsum(0) / max(sum(stages), 1e-9)
        )[:-1].to(torch.float32)
        self._standing = torch.from_numpy(character.standing_qpos()).to(torch.float32)

    def draw(self, scenes: Tensor, episodes: Tensor) -> Starts:
        """The starts of the given scene ids [m] and episode numbers [m] (int64 both)."""
        config, library, bank = self._config, self._library, self._bank
        u = streams.uniform(self._seed, streams.EPISODE, scenes, episodes, 9 + len(_PUSHED_BACK_M))
        kind = torch.bucketize(u[:, 0].contiguous(), self._edges, right=True)
        from_clip = kind == 0

        stage = torch.bucketize(u[:, 1].contiguous(), self._stage_edges, right=True)
        frame = _pick(library.upright, u[:, 2])
        for s, pool in enumerate(library.stages):
            if len(pool):
                frame = torch.where(from_clip & (stage == s), _pick(pool, u[:, 2]), frame)
        frames = library.at(frame)
        rest = ~from_clip & (u[:, 3] < config.standing)
        qpos = torch.where(rest[:, None], self._standing, frames.qpos)
        qvel = torch.where(rest[:, None], torch.zeros_like(frames.qvel), frames.qvel)

        low = torch.where(kind == 1, config.near_m[0], config.far_m[0])
        high = torch.where(kind == 1, config.near_m[1], config.far_m[1])
        distance = (low + (high - low) * u[:, 5])[:, None]
        bearing = _unit(u[:, 6])
        onwards = rotations.turn(_course(qpos, qvel), _unit((u[:, 6] - 0.5) / 4))
        ahead = (kind == 2) & (u[:, 8] < config.ahead)
        offset = distance * torch.where(ahead[:, None], onwards, bearing)
        point = torch.where(from_clip[:, None], frames.seat[:, :2] - frames.qpos[:, :2], offset)
        facing = torch.where(from_clip[:, None], frames.facing, _unit(u[:, 7]))
        above = torch.cat((torch.zeros_like(qpos[:, :2]), qpos[:, 2:3] + _LIFT_M), dim=1)
        starts = Starts(
            qpos=torch.cat((above, qpos[:, 3:]), dim=1),
            qvel=qvel,
            variant=(u[:, 4] * len(bank)).long().clamp_max(len(bank) - 1),
            point=point,
            facing=facing,
            kind=kind,
            frame=torch.where(rest, -1, frame),
        )
        # a scene that stands in for padding is measured once, with the row that it repeats
        first = torch.arange(len(scenes)) == 0
        own = from_clip & (first | (scenes != scenes[0]))
        rows = torch.nonzero(own).flatten()
        starts = self._seated_freely(starts, frames.seat[:, 2], u[:, 9:], rows)
        same = scenes == scenes[0]
        return replace(
            starts,
            variant=torch.where(same, starts.variant[0], starts.variant),
            point=torch.where(same[:, None], starts.point[0], starts.point),
        )

    def _seated_freely(self, starts: Starts, height_m: Tensor, u: Tensor, rows: Tensor) -> Starts:
        """The starts `rows` with furniture of the clip's height that the character does not stand
        in: the first of some candidates, pushed back more and more, or the best of them.
        """
        if not len(rows):
            return starts
        bank, tries, n = self._bank, len(_PUSHED_BACK_M), len(rows)
        back = starts.point.new_tensor(_PUSHED_BACK_M)
        # candidate by candidate: [tries, n], flat for the one call that measures them all
        variant = bank.of_height(height_m[rows].repeat(tries), u[rows].T.flatten())
        facing = starts.facing[rows].repeat(tries, 1)
        point = starts.point[rows].repeat(tries, 1) - back.repeat_interleave(n)[:, None] * facing
        origin, yaw = placed(bank, variant, point, facing)
        centres = clearance.points(starts.qpos)[rows].repeat(tries, 1, 1)
        depth = clearance.depth(centres, origin, yaw, bank, variant).view(tries, n)
        order = torch.arange(tries)[:, None] * 1e-6
        choice = torch.where(depth <= _TOLERATED_M, order - 1.0, depth).argmin(dim=0)
        taken = choice * n + torch.arange(n)
        variants, points = starts.variant.clone(), starts.point.clone()
        variants[rows], points[rows] = variant[taken], point[taken]
        return replace(starts, variant=variants, point=points)


def furniture_pose(bank: Bank, starts: Starts) -> tuple[Tensor, Tensor]:
    """Origin [m, 3] (m) and yaw as cosine and sine [m, 2] of pieces whose place is where `starts`
    has it."""
    return placed(bank, starts.variant, starts.point, starts.facing)


def placed(bank: Bank, variant: Tensor, point: Tensor, facing: Tensor) -> tuple[Tensor, Tensor]:
    """Origin [m, 3] (m) and yaw (cosine, sine) [m, 2] of pieces `variant` [m] whose place is above
    the floor point [m, 2] and faces `facing` [m, 2]."""
    yaw = rotations.turn(bank.facing[variant] * bank.facing.new_tensor((1.0, -1.0)), facing)
    origin = point - rotations.turn(yaw, bank.point[variant, :2])
    return torch.cat((origin, torch.zeros_like(origin[:, :1])), dim=1), yaw


def _course(qpos: Tensor, qvel: Tensor) -> Tensor:
    """Unit vectors [m, 2]: where the root moves, or faces where it hardly moves."""
    speed = qvel[:, :2].norm(dim=1, keepdim=True)
    moving = qvel[:, :2] / speed.clamp_min(1e-6)
    return torch.where(speed > 0.3, moving, rotations.heading(qpos[:, 3:7]))


def _pick(pool: Tensor, u: Tensor) -> Tensor:
    return pool[(u.double() * len(pool)).long().clamp_max(len(pool) - 1)]


def _unit(u: Tensor) -> Tensor:
    """Unit vectors [m, 2] at the angles 2π u."""
    angle = (2 * torch.pi) * u
    return torch.stack((torch.cos(angle), torch.sin(angle)), dim=1)
