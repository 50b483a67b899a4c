"""How episodes start: from a clip's own state with its furniture, or upright with furniture
anywhere near.

A start is a pure function of (seed, scene, episode).
"""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from world import random_streams, rotations
from world.config import WorldConfig
from world.initial.reference import KINDS, States, course, unit
from world.motions.library import MotionLibrary
from world.objects import clearance
from world.objects.furniture_bank import Bank
from world.scene.batch import Scenes
from world.tasks.task import Place

__all__ = ["KINDS", "Starter", "Starts", "furniture_pose"]

#: Furniture of a clip's start: how far each candidate is pushed back, m, and how deep the character
#: may stand in it, m.
_PUSHED_BACK_M = (0.0, 0.0, 0.0, 0.04, 0.04, 0.08)
_TOLERATED_M = 0.015
#: A pelvis below this is sat or lain down, m.
_LOW_M = 0.65


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
        self._config, self._bank, self._seed = config, bank, seed
        self._states = States(config, library)

    def draw(self, scenes: Tensor, episodes: Tensor) -> Starts:
        """The starts of the given scene ids [m] and episode numbers [m] (int64 both)."""
        config, bank = self._config, self._bank
        u = random_streams.uniform(
            self._seed, random_streams.EPISODE, scenes, episodes, 10 + len(_PUSHED_BACK_M)
        )
        close = u[:, -1] < config.front
        drawn = self._states.draw(u, close)
        kind, frames, qpos, qvel = drawn.kind, drawn.frames, drawn.qpos, drawn.qvel
        from_clip = kind == 0

        low = torch.where(kind == 1, config.near_m[0], config.far_m[0])
        high = torch.where(kind == 1, config.near_m[1], config.far_m[1])
        distance = (low + (high - low) * u[:, 5])[:, None]
        bearing = unit(u[:, 6])
        onwards = rotations.turn(course(qpos, qvel), unit((u[:, 6] - 0.5) / 4))
        ahead = (kind == 2) & (u[:, 8] < config.ahead)
        offset = distance * torch.where(ahead[:, None], onwards, bearing)
        facing = unit(u[:, 7])
        # before the seat: most of them close to it and turned nearly as it faces, so that sitting
        # down is found first, then turning round, then coming nearer
        before = (kind == 1) & close
        turned = (2.0 * u[:, 7] - 1.0) * (2.0 * u[:, 7] - 1.0).abs() / 2.0
        facing_before = rotations.turn(rotations.heading(qpos[:, 3:7]), unit(turned))
        facing = torch.where(before[:, None], facing_before, facing)
        span = config.front_m[1] - config.front_m[0]
        back = -(config.front_m[0] + span * u[:, 5].square())[:, None]
        towards = back * rotations.turn(facing, unit((u[:, 6] - 0.5) / 3))
        offset = torch.where(before[:, None], towards, offset)
        variant = (u[:, 4] * len(bank)).long().clamp_max(len(bank) - 1)
        offset = bank.clear_of(variant, offset, facing, before)
        point = torch.where(from_clip[:, None], frames.seat[:, :2] - frames.qpos[:, :2], offset)
        facing = torch.where(from_clip[:, None], frames.facing, facing)
        starts = Starts(
            qpos=drawn.above_origin(),
            qvel=qvel,
            variant=variant,
            point=point,
            facing=facing,
            kind=kind,
            frame=drawn.named_frame(),
        )
        # a scene that stands in for padding is measured once, with the row that it repeats
        first = torch.arange(len(scenes), device=scenes.device) == 0
        own = from_clip & (first | (scenes != scenes[0]))
        rows = torch.nonzero(own).flatten()
        along = (frames.head - frames.seat)[:, :2]
        # the number for the distance is free where the place is the clip's
        raised = u[:, 5] < config.raised
        starts = self._seated_freely(starts, frames.seat[:, 2], raised, along, u[:, 9:-1], rows)
        same = scenes == scenes[0]
        return replace(
            starts,
            variant=torch.where(same, starts.variant[0], starts.variant),
            point=torch.where(same[:, None], starts.point[0], starts.point),
            qpos=torch.where(same[:, None], starts.qpos[0], starts.qpos),
        )

    def place(self, starts: Starts) -> Place:
        """What the task knows of the furniture of `starts`."""
        return self._bank.place(starts.variant, starts.point, starts.facing)

    def put(self, scenes: Scenes, ids: Tensor, starts: Starts) -> None:
        """Set the scenes `ids` [m] up as `starts` has them; their models are there already."""
        pose = furniture_pose(self._bank, starts)
        scenes.set_down(ids, starts.qpos, starts.qvel, *pose)

    def load_n(self, starts: Starts) -> tuple[Tensor, Tensor]:
        """What the hands press with and what weight they bear, N: nothing, [m] each."""
        nothing = torch.zeros_like(starts.qpos[:, 0])
        return nothing, nothing

    def _seated_freely(
        self,
        starts: Starts,
        height_m: Tensor,
        raised: Tensor,
        along: Tensor,
        u: Tensor,
        rows: Tensor,
    ) -> Starts:
        """The starts `rows` with furniture of the clip's height, or `raised` [m] bool of a greater
        one, that the character does not stand in, nor sits or lies beside: the first of some
        candidates, pushed back more and more, or the best of them. along [m, 2] runs from hip to
        head.
        """
        if not len(rows):
            return starts
        bank, tries, n = self._bank, len(_PUSHED_BACK_M), len(rows)
        back = starts.point.new_tensor(_PUSHED_BACK_M)
        # candidate by candidate: [tries, n], flat for the one call that measures them all
        facing = starts.facing[rows].repeat(tries, 1)
        left = _left(starts.facing[rows], along[rows]).repeat(tries)
        own = height_m[rows].repeat(tries)
        drawn = bank.point[starts.variant[rows], 2].repeat(tries)
        wanted = torch.where(raised[rows].repeat(tries), torch.maximum(own, drawn), own)
        variant = bank.of_height(wanted, u[rows].T.flatten(), left)
        point = starts.point[rows].repeat(tries, 1) - back.repeat_interleave(n)[:, None] * facing
        origin, yaw = bank.placed(variant, point, facing)
        # who lies is lifted with the surface: few clips' beds are as high as the catalogue's
        height = starts.qpos[rows, 2].repeat(tries)
        lift = bank.lift(variant, height, own, raised[rows].repeat(tries))
        centres = clearance.points(starts.qpos)[rows].repeat(tries, 1, 1)
        centres = torch.cat((centres[..., :2], centres[..., 2:] + lift[:, None, None]), dim=2)
        depth = clearance.depth(centres, origin, yaw, bank, variant)
        root = torch.zeros_like(point)
        beyond = bank.beyond(variant, root, point, facing)
        low = height < _LOW_M
        sunk = bank.sunk(depth, height, _TOLERATED_M)
        depth = torch.where(low, torch.maximum(depth, beyond), depth).view(tries, n)
        order = torch.arange(tries, device=depth.device)[:, None] * 1e-6
        choice = torch.where(depth <= _TOLERATED_M, order - 1.0, depth).argmin(dim=0)
        taken = choice * n + torch.arange(n, device=choice.device)
        variants, points, qpos = starts.variant.clone(), starts.point.clone(), starts.qpos.clone()
        variants[rows], points[rows] = variant[taken], point[taken]
        qpos[rows, 2] += (lift + sunk)[taken]
        return replace(starts, variant=variants, point=points, qpos=qpos)


def furniture_pose(bank: Bank, starts: Starts) -> tuple[Tensor, Tensor]:
    """Origin [m, 3] (m) and yaw as cosine and sine [m, 2] of pieces whose place is where `starts`
    has it."""
    return bank.placed(starts.variant, starts.point, starts.facing)


def _left(facing: Tensor, along: Tensor) -> Tensor:
    """[m] bool: whether `along` [m, 2] points to the left of where `facing` [m, 2] looks."""
    return facing[:, 0] * along[:, 1] - facing[:, 1] * along[:, 0] > 0.0
