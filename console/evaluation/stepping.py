"""A chunk of trials stepped together: characters set down, disturbed, driven, judged, recorded."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from console.evaluation.arrangement import arranged, sized
from console.recording.format import Take, boxes_of
from policy.model.acting import Policy
from world import tasks
from world.character import model as character
from world.config import WorldConfig
from world.furniture.piece import Piece
from world.scene import simulators
from world.scene.batch import Scenes
from world.scene.box import STAND
from world.scene.perturbations import Disturbance, Mover, Thrower
from world.tasks import Place
from world.tasks.task import state as state_of

#: Trials of one inference, fixed so that rounding does not depend on who steps with whom.
BLOCK = 64
_STEP_S = 1.0 / character.CONTROL_HZ


@dataclass(frozen=True)
class Trials:
    """What each of m trials starts from; the same for a seed, in whatever order they are run."""

    pieces: tuple[Piece, ...]
    """[m], unscaled."""
    scale: NDArray[np.float64]
    """[m]."""
    distance_m: NDArray[np.float64]
    """[m]: from the character to the place on the piece, on the floor."""
    bearing_rad: NDArray[np.float64]
    """[m]: where the piece is, about the character, whose heading is 0: its own random one."""
    facing_rad: NDArray[np.float64]
    """[m]: yaw that the piece's place faces."""
    disturbance: Disturbance
    """Of all m."""
    seed: int = 0
    """That they are drawn from."""
    target_m: tuple[float, float] = (1.0, 10.0)
    """Nearest and farthest target of a box from where it stands, m."""

    def __len__(self) -> int:
        return len(self.pieces)


class Driver(Protocol):
    """Makes the characters of a chunk act."""

    def __call__(self, scenes: Scenes, state: Tensor, goal: Tensor, place: Place) -> None:
        """Do one control step of the n scenes, of states [n, 114] and goals [n, G]."""
        ...


class PolicyDriver:
    """A policy's mean actions."""

    def __init__(self, weights: Mapping[str, Tensor]) -> None:
        self._policy = Policy(weights)

    def __call__(self, scenes: Scenes, state: Tensor, goal: Tensor, place: Place) -> None:
        blocks = zip(state.split(BLOCK), goal.split(BLOCK), strict=True)
        actions = torch.cat([self._policy(s, g) for s, g in blocks])
        # A scene that blew up may hold anything; its trial is over, its numbers are not looked at.
        scenes.act(actions.nan_to_num())


@dataclass(frozen=True)
class Track:
    """One recorded trial: its take, and what was measured on the way."""

    take: Take
    state: NDArray[np.float32]
    """[T, 114]: the state before each step."""
    error_m: NDArray[np.float32]
    """[T]: after each step."""
    model: mujoco.MjModel
    """Of its scene."""
    steps: int
    """Steps before the fall, if any: what comes after is not the policy's."""


@dataclass(frozen=True)
class Part:
    """What happened in a chunk of n trials; see trials.Results."""

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
) -> Part:
    """Run the trials `rows`; the first `record` of them are recorded."""
    task = tasks.make(world.task)
    what = trials.disturbance.rows(rows)
    pieces = [sized(trials.pieces[i], float(trials.scale[i])) for i in rows]
    point, facing = _spots(trials, rows)
    numbers = np.arange(rows.start, rows.stop)
    objects = arranged(
        task.affordance, pieces, what, point, facing, numbers, trials.seed, trials.target_m
    )
    scenes = simulators.each(simulator, objects.bank, world.action_scale, world.action_clip)
    places = objects.begin(scenes)
    thrower = Thrower(what, scenes) if what.kind == "projectiles" else None
    mover = Mover(what, point, facing) if what.kind == "moved" else None
    error = np.full((len(rows), steps), np.inf, np.float32)
    fell_at = np.full(len(rows), steps, np.int64)
    reached = np.zeros((len(rows), len(task.stages)), np.bool_)
    broken = np.zeros(len(rows), np.bool_)
    frames = _Frames(scenes, thrower, record)
    body = scenes.body()
    for step in range(steps):
        if thrower is not None:
            thrower.step(step, body, _STEP_S)
        if mover is not None and (moved := mover.step(body, _STEP_S)) is not None:
            places.write(moved[0], objects.move(scenes, *moved))
        place = scenes.now(places)
        state = state_of(body, place)
        frames.keep(state)
        driver(scenes, state, task.goal_features(body, place), place)
        sound = scenes.finite().numpy()
        body, place = scenes.body(), scenes.now(places)
        error[:, step] = task.error_m(body, place).numpy()
        broken |= ~sound & (fell_at == steps)
        ended = task.fell(body, place).numpy() | ~sound
        fell_at[ended & (fell_at == steps)] = step
        reached |= task.stage(body, place).numpy() & (fell_at == steps)[:, None]
        if (fell_at < steps).all():
            break
    tracks = [
        frames.track(i, pieces[i], trials, rows[i], error[i], fell_at[i]) for i in range(record)
    ]
    return Part(error, fell_at, reached, _disturbed(what, mover, fell_at), broken, tracks)


def _spots(trials: Trials, rows: range) -> tuple[Tensor, Tensor]:
    """Floor points [n, 2] m and facings [n, 2] of the places, the character at the origin."""
    here = slice(rows.start, rows.stop)

    def unit(angle: NDArray[np.float64]) -> Tensor:
        return torch.from_numpy(np.stack((np.cos(angle), np.sin(angle)), 1)).float()

    distance = torch.from_numpy(trials.distance_m[here]).float()
    return distance[:, None] * unit(trials.bearing_rad[here]), unit(trials.facing_rad[here])


def _disturbed(
    what: Disturbance, mover: Mover | None, fell_at: NDArray[np.int64]
) -> NDArray[np.int64]:
    if mover is not None:
        return (mover.elapsed_s >= 0).numpy().astype(np.int64)
    return (what.step.numpy() < fell_at[:, None]).sum(1)


class _Frames:
    """What is kept of the first `record` scenes, step by step."""

    def __init__(self, scenes: Scenes, thrower: Thrower | None, record: int) -> None:
        self._scenes, self._thrower, self._record = scenes, thrower, record
        self._rows: list[dict[str, Tensor]] = []

    def keep(self, state: Tensor) -> None:
        """Add the present moment."""
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
    ) -> Track:
        """The i-th scene as a track; after the fall nothing is kept but a second to see it."""
        steps = min(len(self._rows), int(fell_at) + 1)
        length = min(len(self._rows), steps + character.CONTROL_HZ)

        def column(name: str) -> NDArray[np.float64]:
            return torch.stack([row[name][i] for row in self._rows[:length]]).double().numpy()

        balls = column("balls") if self._thrower is not None else np.zeros((length, 0, 3))
        meta = {
            "trial": trial,
            "distance_m": float(trials.distance_m[trial]),
            "fell_at_step": steps - 1 if fell_at < len(self._rows) else None,
        }
        cargo = piece.category == "box"
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
