"""Initial states of tasks with furniture: reference states with the clip's furniture, and upright
states with furniture anywhere.

An initial state is a pure function of (seed, scene, episode).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from world import random_streams, rotations
from world.config import WorldConfig
from world.initial.focus import chosen, focused
from world.initial.reference import KINDS, CharacterSampler, course, unit
from world.motions.library import MotionLibrary
from world.objects import clearance
from world.objects.furniture_bank import FurnitureBank
from world.scene.batch import Scenes
from world.scene.target import Target

__all__ = ["KINDS", "FurnitureInitialStates", "FurnitureSampler", "furniture_pose"]

#: Furniture of a reference state: how far each candidate is pushed back, m, and how deep the
#: character may penetrate it, m.
_PUSHED_BACK_M = (0.0, 0.0, 0.0, 0.04, 0.04, 0.08)
_TOLERATED_M = 0.015
#: A pelvis below this is sitting or lying, m.
_LOW_M = 0.65


@dataclass(frozen=True)
class FurnitureInitialStates:
    """Initial states of m episodes, world frame, the character above the origin."""

    qpos: Tensor
    """[m, 43]."""
    qvel: Tensor
    """[m, 34]."""
    variant: Tensor
    """[m] int64: the furniture, by number in the bank."""
    point: Tensor
    """[m, 2]: the floor point below the use point, m."""
    facing: Tensor
    """[m, 2]: cosine and sine of the use point's facing."""
    kind: Tensor
    """[m] int64: index into KINDS."""
    frame: Tensor
    """[m] int64: the state's frame in the motion library; −1 for the rest pose."""

    @property
    def place(self) -> tuple[Tensor, Tensor]:
        """Floor point [m, 2] m of the object and its facing [m, 2], which a move begins from."""
        return self.point, self.facing


class FurnitureSampler:
    """Draws the initial states of tasks with furniture; an InitialStateSampler."""

    def __init__(
        self, config: WorldConfig, library: MotionLibrary, bank: FurnitureBank, seed: int
    ) -> None:
        self._config, self._bank, self._seed = config, bank, seed
        self._character = CharacterSampler(config, library)
        #: Numbers are of this usage: the scenes of another task in a mixture have others.
        self._told = f"piece_{bank.affordance}"
        names = list(dict.fromkeys(piece.name for piece in bank.pieces))
        # sizes of a piece count as one: each would have too few episodes
        self._piece = torch.tensor([names.index(piece.name) for piece in bank.pieces])
        self._weight: Tensor | None = None

    def update_sampling(self, published: Mapping[str, Tensor]) -> None:
        """Draw more often, in near and far states, the pieces whose recent failure rates [P] are
        high, which come as `piece_sit` and the like; a piece without an episode yet counts as the
        mean of the others."""
        if (rates := published.get(self._told)) is not None:
            self._weight = focused(self._config.initial.focus, rates, self._piece)

    def episode_records(self, variant: Tensor, kind: Tensor) -> dict[str, Tensor]:
        """Under the same name [k], the number of the piece; NaN for episodes that did not begin
        near: from far many end on the way, and reference states say little of a piece."""
        if not self._config.initial.focus:
            return {}
        return {self._told: torch.where(kind == 1, self._piece[variant].float(), torch.nan)}

    def draw(self, scenes: Tensor, episodes: Tensor) -> FurnitureInitialStates:
        """Initial states for scene ids [m] and episode numbers [m] (int64 both)."""
        initial, bank = self._config.initial, self._bank
        u = random_streams.uniform(
            self._seed, random_streams.EPISODE, scenes, episodes, 10 + len(_PUSHED_BACK_M)
        )
        close = u[:, -1] < initial.front_fraction
        drawn = self._character.draw(u, close)
        kind, frames, qpos, qvel = drawn.kind, drawn.frames, drawn.qpos, drawn.qvel
        from_clip = kind == 0

        low = torch.where(kind == 1, initial.near_m[0], initial.far_m[0])
        high = torch.where(kind == 1, initial.near_m[1], initial.far_m[1])
        distance = (low + (high - low) * u[:, 5])[:, None]
        bearing = unit(u[:, 6])
        onwards = rotations.turn(course(qpos, qvel), unit((u[:, 6] - 0.5) / 4))
        ahead = (kind == 2) & (u[:, 8] < initial.ahead_fraction)
        offset = distance * torch.where(ahead[:, None], onwards, bearing)
        facing = unit(u[:, 7])
        # in front of the seat: most of them close to it and near its facing, so that sitting down
        # is learned first, then turning round, then the approach
        before = (kind == 1) & close
        turned = (2.0 * u[:, 7] - 1.0) * (2.0 * u[:, 7] - 1.0).abs() / 2.0
        facing_before = rotations.turn(rotations.heading(qpos[:, 3:7]), unit(turned))
        facing = torch.where(before[:, None], facing_before, facing)
        span = initial.front_m[1] - initial.front_m[0]
        back = -(initial.front_m[0] + span * u[:, 5].square())[:, None]
        towards = back * rotations.turn(facing, unit((u[:, 6] - 0.5) / 3))
        offset = torch.where(before[:, None], towards, offset)
        variant = chosen(self._weight, len(bank), u[:, 4])
        offset = bank.clear_of(variant, offset, facing, before)
        point = torch.where(from_clip[:, None], frames.seat[:, :2] - frames.qpos[:, :2], offset)
        facing = torch.where(from_clip[:, None], frames.facing, facing)
        states = FurnitureInitialStates(
            qpos=drawn.above_origin(),
            qvel=qvel,
            variant=variant,
            point=point,
            facing=facing,
            kind=kind,
            frame=drawn.named_frame(),
        )
        # the rows of padding repeat the first one, and are computed once
        first = torch.arange(len(scenes), device=scenes.device) == 0
        own = from_clip & (first | (scenes != scenes[0]))
        rows = torch.nonzero(own).flatten()
        along = (frames.head - frames.seat)[:, :2]
        # the uniform number of the distance is unused in reference states
        raised = u[:, 5] < initial.raised_seat_fraction
        states = self._seated_freely(states, frames.seat[:, 2], raised, along, u[:, 9:-1], rows)
        same = scenes == scenes[0]
        return replace(
            states,
            variant=torch.where(same, states.variant[0], states.variant),
            point=torch.where(same[:, None], states.point[0], states.point),
            qpos=torch.where(same[:, None], states.qpos[0], states.qpos),
        )

    def target(self, states: FurnitureInitialStates) -> Target:
        """Targets of the furniture of `states`."""
        return self._bank.target(states.variant, states.point, states.facing)

    def apply(self, scenes: Scenes, ids: Tensor, states: FurnitureInitialStates) -> None:
        """Write `states` into the scenes `ids` [m], which have their models already."""
        pose = furniture_pose(self._bank, states)
        scenes.set_state(ids, states.qpos, states.qvel, *pose)

    def load_n(self, states: FurnitureInitialStates) -> tuple[Tensor, Tensor]:
        """Force of each hand and weight that both bear, N: zeros, [m] each."""
        nothing = torch.zeros_like(states.qpos[:, 0])
        return nothing, nothing

    def _seated_freely(
        self,
        states: FurnitureInitialStates,
        height_m: Tensor,
        raised: Tensor,
        along: Tensor,
        u: Tensor,
        rows: Tensor,
    ) -> FurnitureInitialStates:
        """The states `rows` with furniture of the clip's height, or where raised [m] bool a higher
        one. The choice is the first of some candidates, pushed back more and more, that the
        character neither penetrates nor sits or lies beside; else the best of them. along [m, 2]
        points from hip to head.
        """
        if not len(rows):
            return states
        bank, tries, n = self._bank, len(_PUSHED_BACK_M), len(rows)
        back = states.point.new_tensor(_PUSHED_BACK_M)
        # [tries, n], flattened so that one call evaluates all candidates
        facing = states.facing[rows].repeat(tries, 1)
        left = _left(states.facing[rows], along[rows]).repeat(tries)
        own = height_m[rows].repeat(tries)
        drawn = bank.point[states.variant[rows], 2].repeat(tries)
        wanted = torch.where(raised[rows].repeat(tries), torch.maximum(own, drawn), own)
        variant = bank.of_height(wanted, u[rows].T.flatten(), left)
        point = states.point[rows].repeat(tries, 1) - back.repeat_interleave(n)[:, None] * facing
        origin, yaw = bank.placed(variant, point, facing)
        # a lying character is lifted with the surface: few clips' beds are as high as the
        # catalogue's
        height = states.qpos[rows, 2].repeat(tries)
        lift = bank.lift(variant, height, own, raised[rows].repeat(tries))
        centres = clearance.points(states.qpos)[rows].repeat(tries, 1, 1)
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
        variants, points, qpos = states.variant.clone(), states.point.clone(), states.qpos.clone()
        variants[rows], points[rows] = variant[taken], point[taken]
        qpos[rows, 2] += (lift + sunk)[taken]
        return replace(states, variant=variants, point=points, qpos=qpos)


def furniture_pose(bank: FurnitureBank, states: FurnitureInitialStates) -> tuple[Tensor, Tensor]:
    """Origin [m, 3] (m) and yaw as cosine and sine [m, 2] of the furniture of `states`."""
    return bank.placed(states.variant, states.point, states.facing)


def _left(facing: Tensor, along: Tensor) -> Tensor:
    """[m] bool: whether `along` [m, 2] points to the left of `facing` [m, 2]."""
    return facing[:, 0] * along[:, 1] - facing[:, 1] * along[:, 0] > 0.0
