"""Trials: which piece stands where, fixed by a seed, and what a policy does with each of them."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from console.recording import Recording, Take, boxes_of
from policy.acting import Policy
from world import character, features, rotations, streams, tasks
from world.bank import Bank, scaled
from world.config import WorldConfig
from world.furniture.piece import Piece
from world.scenes import Scenes
from world.tasks import Place

#: Trials stepped together: fixed, so that no figure depends on the number of threads.
CHUNK = 128
#: Trials of one inference, fixed for the same reason.
BLOCK = 64
#: Key of these draws among the streams (world.streams names its own from 1).
PURPOSE = 101


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

    def __len__(self) -> int:
        return len(self.pieces)


def manifest(
    pieces: Sequence[Piece],
    trials: int,
    seed: int,
    near_m: float = 1.0,
    far_m: float = 10.0,
    scale: tuple[float, float] = (0.8, 1.2),
) -> Trials:
    """The trials of a seed: pieces in turn, the rest uniform (paper, section 7.1)."""
    u = streams.uniform(seed, PURPOSE, torch.arange(trials), 0, 4).double().numpy()
    low, high = scale
    return Trials(
        tuple(pieces[i % len(pieces)] for i in range(trials)),
        low + (high - low) * u[:, 0],
        near_m + (far_m - near_m) * u[:, 1],
        2 * np.pi * u[:, 2],
        2 * np.pi * u[:, 3],
    )


@dataclass(frozen=True)
class Results:
    """What happened, a row a trial."""

    error_m: NDArray[np.float32]
    """[m, steps]: the hip's distance from its target after each step."""
    fell_at: NDArray[np.int64]
    """[m]: the step that ended the trial by a fall (or a blow-up); `steps` for none."""
    broken: int
    """Trials that the simulator gave up."""
    takes: list[Take]
    """Of the trials that were to be recorded."""


def run(
    world: WorldConfig,
    weights: dict[str, Tensor],
    trials: Trials,
    steps: int,
    threads: int,
    record: int = 0,
    progress: Callable[[int], None] = lambda done: None,
) -> Results:
    """Run all trials with the policy's mean actions; the first `record` are recorded."""
    torch.set_num_threads(1)
    policy = Policy(weights)
    chunks = [range(i, min(i + CHUNK, len(trials))) for i in range(0, len(trials), CHUNK)]
    done = 0

    def one(rows: range) -> Results:
        nonlocal done
        torch.set_num_threads(1)
        recorded = max(0, min(record - rows.start, len(rows)))
        result = _run_chunk(world, policy, trials, rows, steps, recorded)
        done += len(rows)
        progress(done)
        return result

    with ThreadPoolExecutor(threads, "trials") as pool:
        parts = list(pool.map(one, chunks))
    return Results(
        np.concatenate([p.error_m for p in parts]),
        np.concatenate([p.fell_at for p in parts]),
        sum(p.broken for p in parts),
        [take for p in parts for take in p.takes],
    )


def _run_chunk(
    world: WorldConfig, policy: Policy, trials: Trials, rows: range, steps: int, record: int
) -> Results:
    task = tasks.make(world.task)
    pieces = [scaled(trials.pieces[i], float(trials.scale[i])) for i in rows]
    bank = Bank(pieces)
    scenes = Scenes(bank.models, world.action_scale, world.action_clip)
    place = _set_down(scenes, bank, trials, rows)
    error = np.full((len(rows), steps), np.inf, np.float32)
    fell_at = np.full(len(rows), steps, np.int64)
    broken = np.zeros(len(rows), np.bool_)
    frames: list[dict[str, Tensor]] = []
    body = scenes.body()
    for step in range(steps):
        if record:
            frames.append({k: v[:record].clone() for k, v in scenes.physics().items()})
        state = features.state(body, place.floor_point(), place.facing)
        goal = task.goal_features(body, place)
        actions = [policy(s, g) for s, g in zip(state.split(BLOCK), goal.split(BLOCK), strict=True)]
        # A scene that blew up may hold anything; its trial is over, its numbers are not looked at.
        scenes.act(torch.cat(actions).nan_to_num())
        sound = scenes.finite().numpy()
        body = scenes.body()
        error[:, step] = task.error_m(body, place).numpy()
        broken |= ~sound & (fell_at == steps)
        ended = task.fell(body, place).numpy() | ~sound
        fell_at[ended & (fell_at == steps)] = step
        if (fell_at < steps).all():
            break
    takes = [_take(frames, i, pieces[i], trials, rows[i], int(fell_at[i])) for i in range(record)]
    return Results(error, fell_at, int(broken.sum()), takes)


def _set_down(scenes: Scenes, bank: Bank, trials: Trials, rows: range) -> Place:
    """Characters standing at the origin with heading 0, furniture about them."""
    n = len(rows)
    here = slice(rows.start, rows.stop)

    def unit(angle: NDArray[np.float64]) -> Tensor:
        return torch.from_numpy(np.stack((np.cos(angle), np.sin(angle)), 1)).float()

    point = torch.from_numpy(trials.distance_m[here]).float()[:, None] * unit(
        trials.bearing_rad[here]
    )
    facing = unit(trials.facing_rad[here])
    # The piece is turned and moved until its place is where the trial has it.
    yaw = rotations.turn(bank.facing * torch.tensor([1.0, -1.0]), facing)
    level = torch.zeros(n, 1)
    origin = torch.cat((point - rotations.turn(yaw, bank.point[:, :2]), level), dim=1)
    qpos = torch.from_numpy(character.standing_qpos()).expand(n, -1)
    qvel = torch.zeros(n, character.NV, dtype=torch.float64)
    scenes.set_down(torch.arange(n), qpos, qvel, origin, yaw)
    corners = rotations.turn(yaw[:, None], bank.corners) + origin[:, None]
    return Place(torch.cat((point, bank.point[:, 2:]), dim=1), facing, corners)


def _take(
    frames: list[dict[str, Tensor]], i: int, piece: Piece, trials: Trials, trial: int, fell_at: int
) -> Take:
    def column(name: str) -> NDArray[np.float64]:
        return torch.stack([frame[name][i] for frame in frames]).double().numpy()

    return Take(
        column("qpos"),
        column("qvel"),
        column("ctrl"),
        column("mocap_pos")[:, 0],
        column("mocap_quat")[:, 0],
        boxes_of(piece),
        piece.name,
        float(trials.scale[trial]),
        {
            "trial": trial,
            "distance_m": float(trials.distance_m[trial]),
            "fell_at_step": fell_at if fell_at < len(frames) else None,
        },
    )


def recording(results: Results, meta: dict[str, object]) -> Recording:
    """The recorded trials with what made them."""
    return Recording(results.takes, {"control_hz": character.CONTROL_HZ, **meta})
