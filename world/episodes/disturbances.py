"""Disturbances of a shard's episodes: pushes, projectiles, and objects that move.

All draws are functions of seed, scene, and control step or episode, so that they do not depend on
the division of the scenes over actors.
"""

from typing import cast

import torch
from torch import Tensor

from world import random_streams
from world.character import model as character
from world.character.features import Body
from world.config import PerturbConfig, WorldConfig
from world.errors import ConfigError
from world.initial.sampler import InitialStateBatch, Placed
from world.objects.bank import MovableBank, ObjectBank
from world.scene import perturbations
from world.scene.batch import Scenes
from world.scene.perturbations import TRAINING, Balls, Mover
from world.scene.target import Target
from world.tasks import make

_STEP_S = 1.0 / character.CONTROL_HZ
#: Index sets are padded to multiples of this: torch's vectorised loops and their scalar tails may
#: round differently, and the numbers of a scene must not depend on the others that reset with it.
LANES = 32
#: Bodies that are pushed, by index into character.BODIES: pelvis and torso.
PUSHED = (0, 1)


def active(config: PerturbConfig) -> bool:
    """Whether a configuration has any disturbance."""
    return bool(_given(config))


def _given(config: PerturbConfig) -> list[str]:
    """The rates of a configuration that are not 0, by name."""
    rates = ("pushes_per_s", "projectiles_per_s") if config.fraction > 0.0 else ()
    return [name for name in (*rates, "moved_fraction") if getattr(config, name) > 0.0]


def check(config: WorldConfig, simulator: str) -> None:
    """Raise ConfigError where the disturbances of a world are not possible or contradict one
    another."""
    how = config.perturb
    if not active(how):
        return
    if simulator != "mujoco":
        flag = f"--world.perturb.{_given(how)[0].replace('_', '-')}"
        raise ConfigError(
            f"{flag} needs --simulator mujoco: scenes of {simulator} stay undisturbed"
        )
    low, high = how.push_n_s
    if not low <= high:
        raise ConfigError(f"--world.perturb.push-n-s {low:g} {high:g}: the smaller first")
    if how.moved_fraction and make(config.task).affordance.follows_clips:
        raise ConfigError(
            "--world.perturb.moved-fraction: this task follows clips, whose objects stay; leave it"
            " out"
        )


class Disturbances:
    """Disturbances of the scenes `ids` [n] (global)."""

    def __init__(
        self, config: PerturbConfig, scenes: Scenes, bank: ObjectBank, ids: Tensor, seed: int
    ) -> None:
        self._config, self._scenes, self._bank = config, scenes, bank
        self._ids, self._seed, n = ids, seed, len(ids)
        self._disturbed = torch.zeros(n, dtype=torch.bool)
        self._slot = torch.zeros(n, dtype=torch.int64)
        self._balls = Balls(TRAINING, scenes) if config.projectiles_per_s else None
        nothing = perturbations.draw("moved", n, seed, 0)
        self._mover = Mover(nothing, torch.zeros(n, 2), torch.zeros(n, 2))

    def push(self, clock: int) -> None:
        """Push the characters that are due in the control step that begins now, the `clock`-th of
        the shard."""
        if not self._config.pushes_per_s:
            return
        u = self._draw(clock)
        low, high = self._config.push_n_s
        angle = 2 * torch.pi * u[:, 1]
        strength = low + (high - low) * u[:, 2]
        impulse = torch.stack((angle.cos(), angle.sin(), torch.zeros_like(angle)), dim=1)
        impulse = strength[:, None] * impulse
        which = torch.where(u[:, 3] < 0.5, *PUSHED)
        due = self._disturbed & (u[:, 0] < self._config.pushes_per_s * _STEP_S)
        ids = torch.nonzero(due).flatten()
        if len(ids):
            self._scenes.push(ids, which[ids], impulse[ids])

    def after(self, clock: int, body: Body, now: Target, targets: Target, variant: Tensor) -> bool:
        """Throw balls and move objects after a control step that ended in `body`.

        Args: now [n]: present targets; targets [n]: where those of moved objects are written;
        variant [n]: of the objects. Returns whether any moved.
        """
        if self._balls is not None:
            self._throw(self._balls, clock, body)
        moved = self._mover.step(body, _STEP_S) if self._config.moved_fraction else None
        if moved is None:
            return False
        bank = cast("MovableBank", self._bank)  # checked with the configuration
        # padded as the shard's resets are: roundings must not depend on how many move at a time
        ids, point, facing = (
            torch.cat((part, part[:1].expand(-len(part) % LANES, *part.shape[1:])))
            for part in moved
        )
        part = bank.move(self._scenes, ids, variant[ids], now.rows(ids), point, facing)
        targets.write(ids, part)
        return True

    def _throw(self, balls: Balls, clock: int, body: Body) -> None:
        balls.age_s += _STEP_S
        u = self._draw(clock)
        due = self._disturbed & (u[:, 4] < self._config.projectiles_per_s * _STEP_S)
        ids = torch.nonzero(due).flatten()
        if len(ids):
            position, velocity = perturbations.launch(
                TRAINING, u[:, 5:], body, torch.arange(len(u))
            )
            balls.launch(ids, self._slot[ids], position[ids], velocity[ids])
            self._slot[ids] = (self._slot[ids] + 1) % TRAINING.flying
        balls.park()

    def _draw(self, clock: int) -> Tensor:
        """[n, 9] uniform numbers of a control step: of the push 4, of the ball 5."""
        return random_streams.uniform(
            self._seed, random_streams.DISTURBED_STEP, self._ids, clock, 9
        )

    def reset(self, rows: Tensor, episodes: Tensor, states: InitialStateBatch, body: Body) -> None:
        """Begin the episodes `episodes` [m] in the scenes `rows` [m] (local), whose characters
        begin as in `body` [m]; a scene may be there twice."""
        u = random_streams.uniform(
            self._seed, random_streams.DISTURBED_EPISODE, self._ids[rows], episodes, 6
        )
        self._disturbed[rows] = u[:, 0] < self._config.fraction
        if self._balls is not None:
            self._balls.age_s[rows] = torch.inf
            self._balls.park()
        if self._config.moved_fraction:
            assert isinstance(states, Placed), "checked with the configuration"
            point, facing = states.place
            away = (point - body.root[:, :2]).norm(dim=1) > perturbations.Moving().near_m[0]
            moves = away & (u[:, 1] < self._config.moved_fraction)
            self._mover.restart(rows, u[:, 2:], point, facing, moves)

    def state_dict(self) -> dict[str, Tensor]:
        """The state between control steps, by name, without copies."""
        own = {"disturbed": self._disturbed, "slot": self._slot}
        if self._balls is not None:
            own["ball_age_s"] = self._balls.age_s
        return own | {f"move_{name}": value for name, value in self._mover.tensors().items()}

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        for name, value in self.state_dict().items():
            value.copy_(state[name])
