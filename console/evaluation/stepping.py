"""Simulation of a chunk of trials: initial states, disturbances, actions, results, recording."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import mujoco
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from console.recording.format import Take, boxes_of
from policy.model.acting import Policy
from world import tasks
from world.affordances.affordance import Setting
from world.character import model as character
from world.config import WorldConfig
from world.furniture.piece import Piece
from world.scene import simulators
from world.scene.batch import Scenes
from world.scene.box import STAND, is_box
from world.scene.perturbations import Disturbance, Mover, Thrower
from world.scene.target import Target
from world.scene.target import state as state_of
from world.tasks.task import Task

#: Trials of one inference, fixed so that rounding does not depend on the batch.
BLOCK = 64
_STEP_S = 1.0 / character.CONTROL_HZ


@dataclass(frozen=True)
class Trials:
    """Initial states of m trials, fixed by a seed and independent of the order of simulation."""

    pieces: tuple[Piece, ...]
    """[m], unscaled."""
    scale: NDArray[np.float64]
    """[m] scale of the piece."""
    distance_m: NDArray[np.float64]
    """[m] horizontal distance from the character to the target on the piece."""
    bearing_rad: NDArray[np.float64]
    """[m] direction of the target from the character, whose heading is 0."""
    facing_rad: NDArray[np.float64]
    """[m] yaw of the target's facing."""
    disturbance: Disturbance
    """Disturbances of all m."""
    seed: int = 0
    """Seed of the trials."""
    target_m: tuple[float, float] = (1.0, 10.0)
    """Smallest and largest distance of a box's target from its initial position, m."""
    numbers: NDArray[np.int64] | None = None
    """[m] numbers of the trials, which their draws depend on; None: from 0."""

    def __len__(self) -> int:
        return len(self.pieces)

    def numbered(self) -> NDArray[np.int64]:
        """Return the numbers [m] of the trials."""
        return np.arange(len(self)) if self.numbers is None else self.numbers

    def chosen(self, rows: Sequence[int]) -> "Trials":
        """Return the trials `rows`, each as it is among the others."""
        here = list(rows)
        return replace(
            self,
            pieces=tuple(self.pieces[i] for i in here),
            scale=self.scale[here],
            distance_m=self.distance_m[here],
            bearing_rad=self.bearing_rad[here],
            facing_rad=self.facing_rad[here],
            disturbance=self.disturbance.rows(here),
            numbers=self.numbered()[here],
        )


class Driver(Protocol):
    """A controller of the characters of a chunk."""

    def __call__(self, scenes: Scenes, state: Tensor, goal: Tensor, target: Target) -> None:
        """Step n scenes by one control step, from states [n, 114] and goals [n, G]."""
        ...


class PolicyDriver:
    """Driver by the mean actions of a policy."""

    def __init__(self, weights: Mapping[str, Tensor]) -> None:
        self._policy = Policy(weights)

    def __call__(self, scenes: Scenes, state: Tensor, goal: Tensor, target: Target) -> None:
        blocks = zip(state.split(BLOCK), goal.split(BLOCK), strict=True)
        actions = torch.cat([self._policy(s, g) for s, g in blocks])
        # The state of a non-finite scene is arbitrary; its trial has ended and is not evaluated.
        scenes.act(actions.nan_to_num())


@dataclass(frozen=True)
class Track:
    """One recorded trial: its take, states and errors."""

    take: Take
    state: NDArray[np.float32]
    """[T, 114] state before each step."""
    error_m: NDArray[np.float32]
    """[T] error after each step, m."""
    model: mujoco.MjModel
    """Model of the scene."""
    steps: int
    """Number of steps before the fall, or of all without one; later steps are not evaluated."""


@dataclass(frozen=True)
class ChunkResults:
    """Results of a chunk of n trials; the fields are those of trials.Results."""

    error_m: NDArray[np.float32]
    fell_at: NDArray[np.int64]
    reached: NDArray[np.bool_]
    disturbed: NDArray[np.int64]
    broken: NDArray[np.bool_]
    tracks: list[Track]


def step_chunk(
    world: WorldConfig,
    driver: Driver,
    trials: Trials,
    rows: range,
    steps: int,
    record: int,
    simulator: str = "mujoco",
) -> ChunkResults:
    """Simulate the trials `rows` and record the first `record` of them."""
    task = tasks.make(world.task)
    disturbance = trials.disturbance.rows(rows)
    pieces = [task.affordance.sized(trials.pieces[i], float(trials.scale[i])) for i in rows]
    point, facing = _targets(trials, rows)
    numbers = trials.numbered()[rows.start : rows.stop]
    objects = task.affordance.arrange(
        Setting(pieces, disturbance, point, facing, numbers, trials.seed, trials.target_m)
    )
    scenes = simulators.each(simulator, objects.bank, world.action_scale, world.action_clip)
    targets = objects.begin(scenes)
    thrower = Thrower(disturbance, scenes) if disturbance.kind == "projectiles" else None
    mover = Mover(disturbance, objects.point, facing) if disturbance.kind == "moved" else None
    error = np.full((len(rows), steps), np.inf, np.float32)
    fell_at = np.full(len(rows), steps, np.int64)
    first = np.full((len(rows), len(task.stages)), steps, np.int64)
    broken = np.zeros(len(rows), np.bool_)
    frames = _Frames(scenes, thrower, record)
    body = scenes.body()
    for step in range(steps):
        if thrower is not None:
            thrower.step(step, body, _STEP_S)
        if mover is not None and (moved := mover.step(body, _STEP_S)) is not None:
            targets.write(moved[0], objects.move(scenes, *moved))
        target = scenes.now(targets)
        state = state_of(body, target)
        frames.keep(state)
        driver(scenes, state, task.goal_features(body, target), target)
        finite = scenes.finite().numpy()
        body, target = scenes.body(), scenes.now(targets)
        error[:, step] = task.error_m(body, target).numpy()
        broken |= ~finite & (fell_at == steps)
        ended = task.fell(body, target).numpy() | ~finite
        fell_at[ended & (fell_at == steps)] = step
        stages = task.stage(body, target).numpy() & (fell_at == steps)[:, None]
        first[stages & (first == steps)] = step
        if (fell_at < steps).all():
            break
    tracks = [
        frames.track(
            i, pieces[i], trials, rows[i], error[i], fell_at[i], _events(task, error[i], first[i])
        )
        for i in range(record)
    ]
    disturbed = _disturbed(disturbance, mover, fell_at)
    return ChunkResults(error, fell_at, first < steps, disturbed, broken, tracks)


def _events(task: Task, error_m: NDArray[np.float32], first: NDArray[np.int64]) -> dict[str, Any]:
    """Return the first control step of each stage, and of success, of a trial for its take."""
    reached = {
        name: int(step)
        for name, step in zip(task.stages, first, strict=True)
        if step < len(error_m)
    }
    good = np.flatnonzero(error_m <= task.success_m)
    return {"stages": reached, "success_at_step": int(good[0]) if len(good) else None}


def _targets(trials: Trials, rows: range) -> tuple[Tensor, Tensor]:
    """Return floor points [n, 2] m and facings [n, 2] of the targets; characters are at the
    origin."""
    here = slice(rows.start, rows.stop)

    def unit(angle: NDArray[np.float64]) -> Tensor:
        return torch.from_numpy(np.stack((np.cos(angle), np.sin(angle)), 1)).float()

    distance = torch.from_numpy(trials.distance_m[here]).float()
    return distance[:, None] * unit(trials.bearing_rad[here]), unit(trials.facing_rad[here])


def _disturbed(
    disturbance: Disturbance, mover: Mover | None, fell_at: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the number of disturbances of each trial [n]: moves, or balls before the fall."""
    if mover is not None:
        return (mover.elapsed_s >= 0).numpy().astype(np.int64)
    return (disturbance.step.numpy() < fell_at[:, None]).sum(1)


class _Frames:
    """Frames of the first `record` scenes."""

    def __init__(self, scenes: Scenes, thrower: Thrower | None, record: int) -> None:
        self._scenes, self._thrower, self._record = scenes, thrower, record
        self._rows: list[dict[str, Tensor]] = []

    def keep(self, state: Tensor) -> None:
        """Add the present frame; state [n, 114]."""
        if not self._record:
            return
        row = {k: v[: self._record] for k, v in self._scenes.physics().items()}
        row["state"] = state[: self._record].clone()
        if self._thrower is not None:
            row["balls"] = self._thrower.position[: self._record]
        self._rows.append(row)

    def track(
        self,
        i: int,
        piece: Piece,
        trials: Trials,
        trial: int,
        error_m: NDArray[np.float32],
        fell_at: np.int64,
        events: dict[str, Any],
    ) -> Track:
        """Return the i-th scene as a track, which ends a second after the fall; `events` are
        added to the take's meta."""
        steps = min(len(self._rows), int(fell_at) + 1)
        length = min(len(self._rows), steps + character.CONTROL_HZ)

        def column(name: str) -> NDArray[np.float64]:
            return torch.stack([row[name][i] for row in self._rows[:length]]).double().numpy()

        balls = column("balls") if self._thrower is not None else np.zeros((length, 0, 3))
        meta = {
            "trial": int(trials.numbered()[trial]),
            "distance_m": float(trials.distance_m[trial]),
            "fell_at_step": steps - 1 if fell_at < len(self._rows) else None,
            **events,
        }
        cargo = is_box(piece)
        take = Take(
            column("qpos")[:, : character.NQ + 7 * cargo],
            column("qvel")[:, : character.NV + 6 * cargo],
            column("ctrl"),
            column("mocap_pos")[:, 0],
            column("mocap_quat")[:, 0],
            boxes_of(STAND if cargo else piece),
            piece.name,
            float(trials.scale[trial]),
            meta,
            balls,
            np.array(piece.boxes[0].half_m) if cargo else np.zeros(0),
            column("mocap_pos")[0, 1] if cargo else np.zeros(0),
        )
        state = column("state").astype(np.float32)
        return Track(take, state, error_m[:length], self._scenes.models[i], steps)
