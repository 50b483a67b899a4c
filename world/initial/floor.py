"""Initial states of walking: reference states with the target where the clip goes, and upright
states with a target anywhere.

An initial state is a pure function of (seed, scene, episode).
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from world import random_streams, rotations
from world.config import WorldConfig
from world.initial.reference import CharacterSampler, course, unit
from world.motions.library import MotionLibrary
from world.objects.floor_bank import FloorBank
from world.scene.batch import Scenes
from world.scene.target import Target


@dataclass(frozen=True)
class FloorInitialStates:
    """Initial states of m episodes, world frame, the character above the origin."""

    qpos: Tensor
    """[m, 43]."""
    qvel: Tensor
    """[m, 34]."""
    variant: Tensor
    """[m] int64: 0, the only scene of the bank."""
    point: Tensor
    """[m, 2]: the target on the floor, m."""
    facing: Tensor
    """[m, 2]: cosine and sine of the target's facing."""
    kind: Tensor
    """[m] int64: index into world.initial.reference.KINDS."""
    frame: Tensor
    """[m] int64: the state's frame in the motion library; −1 for the rest pose."""

    @property
    def place(self) -> tuple[Tensor, Tensor]:
        """Floor point [m, 2] m of the object and its facing [m, 2], which a move begins from."""
        return self.point, self.facing


class FloorSampler:
    """Draws the initial states of walking; an InitialStateSampler."""

    def __init__(
        self, config: WorldConfig, library: MotionLibrary, bank: FloorBank, seed: int
    ) -> None:
        """Raises ConfigError for invalid fractions, ClipError where reference states are configured
        and no clip walks."""
        self._config, self._bank, self._seed = config, bank, seed
        self._character = CharacterSampler(config, library)

    def draw(self, scenes: Tensor, episodes: Tensor) -> FloorInitialStates:
        """Initial states for scene ids [m] and episode numbers [m] (int64 both)."""
        config = self._config.initial
        u = random_streams.uniform(self._seed, random_streams.EPISODE, scenes, episodes, 10)
        # close targets: standing and turning are learned first, then the last steps
        here = u[:, 9] < config.front_fraction
        drawn = self._character.draw(u, here)
        kind, qpos, qvel, frames = drawn.kind, drawn.qpos, drawn.qvel, drawn.frames
        low = torch.where(kind == 1, config.near_m[0], config.far_m[0])
        high = torch.where(kind == 1, config.near_m[1], config.far_m[1])
        distance = low + (high - low) * u[:, 5]
        at_hand = (kind == 1) & here
        distance = torch.where(at_hand, config.near_m[0] * u[:, 5].square(), distance)
        onwards = rotations.turn(course(qpos, qvel), unit((u[:, 6] - 0.5) / 4))
        ahead = (kind == 2) & (u[:, 8] < config.ahead_fraction)
        point = distance[:, None] * torch.where(ahead[:, None], onwards, unit(u[:, 6]))
        turned = (2.0 * u[:, 7] - 1.0) * (2.0 * u[:, 7] - 1.0).abs() / 2.0
        facing = rotations.turn(rotations.heading(qpos[:, 3:7]), unit(turned))
        facing = torch.where(at_hand[:, None], facing, unit(u[:, 7]))
        from_clip = (kind == 0)[:, None]
        point = torch.where(from_clip, (frames.seat - frames.qpos[:, :3])[:, :2], point)
        facing = torch.where(from_clip, frames.facing, facing)
        return FloorInitialStates(
            drawn.above_origin(),
            qvel,
            torch.zeros_like(kind),
            point,
            facing,
            kind,
            drawn.named_frame(),
        )

    def target(self, states: FloorInitialStates) -> Target:
        """Targets of `states`."""
        return self._bank.target(states.point, states.facing)

    def apply(self, scenes: Scenes, ids: Tensor, states: FloorInitialStates) -> None:
        """Write `states` into the scenes `ids` [m]."""
        pose = self._bank.placed(states.point, states.facing)
        scenes.set_state(ids, states.qpos, states.qvel, *pose)

    def load_n(self, states: FloorInitialStates) -> tuple[Tensor, Tensor]:
        """Force of each hand and weight that both bear, N: zeros, [m] each."""
        nothing = torch.zeros_like(states.qpos[:, 0])
        return nothing, nothing
