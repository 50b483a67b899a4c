"""Disturbances of a scene: projectiles, or furniture that moves during the trial."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import torch
from torch import Tensor

from world import random_streams, rotations
from world.character.features import Body
from world.config import PerturbConfig
from world.errors import ChoiceError
from world.scene.batch import Scenes
from world.scene.model import PROJECTILE_BODY, Ball

Kind = Literal["none", "projectiles", "moved"]
KINDS: tuple[Kind, ...] = ("none", "projectiles", "moved")
_GRAVITY_M_S2 = 9.81
#: Position of balls before and after their flight, m.
_PARKED_M = (60.0, 0.0, 40.0)


@dataclass(frozen=True)
class Throwing:
    """Settings of projectiles. The paper gives their number and mass; the others are ours.

    Launch heights are those of published code (ASE), but not its 30-40 m/s: at 120 Hz a ball of
    that speed passes through a trunk between two substeps. Measured on a floating character: from 5
    to 20 m/s a hit transfers 1.00 to 1.16 of the ball's momentum, as an impact between inelastic
    and slightly elastic does; at 30 m/s 0.38 to 1.10.
    """

    count: int = 20
    """Balls in a trial, at random times within its limit."""
    ball: Ball = field(default_factory=Ball)
    speed_m_s: float = 10.0
    """Speed along the straight line to the aim, relative to the root."""
    distance_m: tuple[float, float] = (2.0, 3.0)
    """Least and greatest horizontal distance of the launch from the root."""
    height_m: tuple[float, float] = (0.25, 2.0)
    """Least and greatest height of the launch."""
    flying: int = 4
    """Balls in the scene at once; one more replaces the oldest."""
    stay_s: float = 2.0
    """Time after its launch for which a ball is in the scene."""


@dataclass(frozen=True)
class Moving:
    """Settings of furniture that moves once in a trial, when the character comes near."""

    near_m: tuple[float, float] = (0.4, 2.0)
    """Least and greatest horizontal distance of the root from the use point that starts the
    move."""
    shift_m: tuple[float, float] = (0.5, 1.5)
    """Least and greatest displacement."""
    turn_rad: float = torch.pi / 4
    """Largest turn about the use point, either way."""
    seconds: float = 0.5
    """Duration of the move, which is smooth and within 90 degrees of away from the character."""


@dataclass(frozen=True)
class Disturbance:
    """Disturbances of m trials; a pure function of the seed and the trial's number."""

    kind: Kind
    step: Tensor
    """[m, count] int64, ascending, all different: control steps of the launches; [m, 0] without."""
    draw: Tensor
    """[m, count, 4] or [m, 4], uniform in [0, 1): the other random numbers."""
    throwing: Throwing = field(default_factory=Throwing)
    moving: Moving = field(default_factory=Moving)

    def rows(self, rows: Sequence[int]) -> "Disturbance":
        """The trials `rows`."""
        here = list(rows)
        return Disturbance(self.kind, self.step[here], self.draw[here], self.throwing, self.moving)

    def balls(self) -> tuple[Ball, ...]:
        """The balls that the model of every scene must have."""
        return (self.throwing.ball,) * self.throwing.flying if self.kind == "projectiles" else ()


def draw(
    kind: str, trials: int, seed: int, steps: int, throwing: Throwing = Throwing()
) -> Disturbance:
    """Disturbances of `trials` trials of `steps` control steps. Raises ChoiceError, which lists
    KINDS."""
    ids = torch.arange(trials)
    none = torch.zeros(trials, 0, dtype=torch.int64)
    if kind == "projectiles":
        u = random_streams.uniform(seed, random_streams.THROWS, ids, 0, 5 * throwing.count)
        u = u.view(trials, throwing.count, 5)
        # sorted draws among steps − count, plus 0, 1, 2, ..., are all different
        first = (u[..., 0] * (steps - throwing.count + 1)).long().sort(dim=1).values
        return Disturbance(kind, first + torch.arange(throwing.count), u[..., 1:], throwing)
    if kind == "moved":
        return Disturbance(
            kind, none, random_streams.uniform(seed, random_streams.MOVES, ids, 0, 4)
        )
    if kind == "none":
        return Disturbance(kind, none, torch.zeros(trials, 4))
    raise ChoiceError("--perturb", kind, list(KINDS))


#: Balls of training: with fewer in the scene a step costs less.
TRAINING = Throwing(flying=2)


def training_balls(config: PerturbConfig) -> tuple[Ball, ...]:
    """The balls that the model of every training scene must have."""
    return (TRAINING.ball,) * TRAINING.flying if config.projectiles_per_s else ()


class Balls:
    """The balls in flight of n scenes; the others are parked."""

    def __init__(self, how: Throwing, scenes: Scenes) -> None:
        self._how, self._scenes = how, scenes
        model = scenes.models[0]
        first = model.body(f"{PROJECTILE_BODY}0").jntadr[0]
        # free bodies follow the character; a box to carry may come before the balls
        self._q = int(model.jnt_qposadr[first]) - model.nq + scenes.free_qpos.shape[1]
        self._v = int(model.jnt_dofadr[first]) - model.nv + scenes.free_qvel.shape[1]
        self.age_s = torch.full((scenes.n, how.flying), torch.inf)
        """[n, flying]: time since the launch; infinite before the first."""
        point = torch.tensor(_PARKED_M, dtype=torch.float64).repeat(how.flying, 1)
        point[:, 1] = 2.0 * torch.arange(how.flying)
        level = torch.tensor([[1.0, 0, 0, 0]]).repeat(how.flying, 1)
        self._parked = torch.cat((point, level), dim=1)

    @property
    def position(self) -> Tensor:
        """[n, flying, 3] m, world; NaN for parked balls."""
        at = self._coordinates()[0][..., :3].clone()
        at[self.age_s > self._how.stay_s] = torch.nan
        return at

    def _coordinates(self) -> tuple[Tensor, Tensor]:
        flying = self._how.flying
        qpos = self._scenes.free_qpos[:, self._q : self._q + 7 * flying]
        qvel = self._scenes.free_qvel[:, self._v : self._v + 6 * flying]
        return qpos.unflatten(1, (flying, 7)), qvel.unflatten(1, (flying, 6))

    def launch(self, scene: Tensor, slot: Tensor, position: Tensor, velocity: Tensor) -> None:
        """Launch the balls `slot` [k] of the scenes [k] from positions [k, 3] m with velocities [k,
        3] m/s."""
        qpos, qvel = self._coordinates()
        self.age_s[scene, slot] = 0.0
        level = position.new_tensor([[1.0, 0, 0, 0]]).repeat(len(scene), 1)
        qpos[scene, slot] = torch.cat((position, level), dim=1).double()
        qvel[scene, slot] = torch.cat((velocity, torch.zeros_like(velocity)), dim=1).double()

    def park(self) -> None:
        """Park the balls that have been in the scene for `stay_s`."""
        qpos, qvel = self._coordinates()
        parked = self.age_s > self._how.stay_s
        qpos[parked] = self._parked.repeat(len(qpos), 1, 1)[parked]
        qvel[parked] = 0.0


class Thrower:
    """Launches the balls of n scenes at their characters, by a timetable."""

    def __init__(self, disturbance: Disturbance, scenes: Scenes) -> None:
        self._what, self._balls = disturbance, Balls(disturbance.throwing, scenes)

    @property
    def position(self) -> Tensor:
        """[n, flying, 3] m, world; NaN for parked balls."""
        return self._balls.position

    def step(self, step: int, body: Body, seconds: float) -> None:
        """Launch the balls that are due, before the control step `step` of `seconds`."""
        how, what = self._what.throwing, self._what
        self._balls.age_s += seconds
        scene, number = torch.nonzero(what.step == step, as_tuple=True)
        if len(scene):
            flight = launch(how, what.draw[scene, number], body, scene)
            self._balls.launch(scene, number % how.flying, *flight)
        self._balls.park()


def launch(how: Throwing, u: Tensor, body: Body, scene: Tensor) -> tuple[Tensor, Tensor]:
    """Initial positions [k, 3] m and velocities [k, 3] m/s of balls that hit a body's origin.

    u [k, 4]: bearing, distance, height and choice of the body. The aim moves on with the root's
    velocity, and the drop under gravity is compensated.
    """
    root, angle = body.root[scene], 2 * torch.pi * u[:, 0]
    distance = how.distance_m[0] + (how.distance_m[1] - how.distance_m[0]) * u[:, 1]
    height = how.height_m[0] + (how.height_m[1] - how.height_m[0]) * u[:, 2]
    xy = root[:, :2] + distance[:, None] * rotations.cos_sin(angle)
    position = torch.cat((xy, height[:, None]), dim=1)
    which = (u[:, 3] * body.position.shape[1]).long().clamp_max(body.position.shape[1] - 1)
    aim = body.position[scene, which] - position
    seconds = (aim.norm(dim=1) / how.speed_m_s)[:, None]
    drop = seconds.new_tensor((0.0, 0.0, 0.5 * _GRAVITY_M_S2))
    return position, aim / seconds + body.root_velocity[scene] + drop * seconds


class Mover:
    """Moves the objects of n scenes, each at most once, when its character comes near."""

    def __init__(self, disturbance: Disturbance, point: Tensor, facing: Tensor) -> None:
        """point [n, 2] m: the floor below the use point; facing [n, 2] (cosine, sine): both before
        the move."""
        self._how, n = disturbance.moving, len(point)
        self._near_m = torch.zeros(n)
        self._shift_m, self._sideways, self._turn = torch.zeros(3, n).unbind(0)
        self._point, self._facing = point.clone(), facing.clone()
        self._direction = torch.zeros_like(point)
        self.elapsed_s = torch.full((n,), -1.0)
        """[n]: time since the move began; −1 before it."""
        self.restart(torch.arange(n), disturbance.draw, point, facing)

    def restart(
        self,
        ids: Tensor,
        draw: Tensor,
        point: Tensor,
        facing: Tensor,
        moves: Tensor | None = None,
    ) -> None:
        """Begin anew in the scenes `ids` [m], with draws [m, 4] uniform in [0, 1), and points and
        facings as above; moves [m] bool: which of them move; None: all."""
        low, high = self._how.near_m
        near_m = low + (high - low) * draw[:, 0]
        self._near_m[ids] = near_m if moves is None else torch.where(moves, near_m, -1.0)
        low, high = self._how.shift_m
        self._shift_m[ids] = low + (high - low) * draw[:, 1]
        self._sideways[ids] = torch.pi * (draw[:, 2] - 0.5)
        self._turn[ids] = self._how.turn_rad * (2 * draw[:, 3] - 1)
        self._point[ids], self._facing[ids] = point, facing
        self._direction[ids], self.elapsed_s[ids] = 0.0, -1.0

    def tensors(self) -> dict[str, Tensor]:
        """All state, [n, ...] each, by name, without copies."""
        return {
            "near_m": self._near_m,
            "shift_m": self._shift_m,
            "sideways": self._sideways,
            "turn": self._turn,
            "point": self._point,
            "facing": self._facing,
            "direction": self._direction,
            "elapsed_s": self.elapsed_s,
        }

    def step(self, body: Body, seconds: float) -> tuple[Tensor, Tensor, Tensor] | None:
        """Scenes [m] that move in the next control step of `seconds`, with their floor points [m,
        2] and facings [m, 2] after it; None where none moves."""
        away = self._point - body.root[:, :2]
        begin = (self.elapsed_s < 0) & (away.norm(dim=1) <= self._near_m)
        if begin.any():
            away = away / away.norm(dim=1, keepdim=True).clamp_min(1e-6)
            self._direction[begin] = rotations.turn(rotations.cos_sin(self._sideways), away)[begin]
        moving = begin | (self.elapsed_s >= 0) & (self.elapsed_s < self._how.seconds)
        if not moving.any():
            return None
        self.elapsed_s[begin] = 0.0
        self.elapsed_s[moving] += seconds
        part = (self.elapsed_s / self._how.seconds).clamp(0.0, 1.0)
        part = part.square() * (3 - 2 * part)
        point = self._point + (part * self._shift_m)[:, None] * self._direction
        facing = rotations.turn(rotations.cos_sin(part * self._turn), self._facing)
        ids = torch.nonzero(moving).flatten()
        return ids, point[ids], facing[ids]
