"""Trials of an evaluation: initial states fixed by a seed, and the results of a policy."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from console.evaluation.stepping import Driver, PolicyDriver, Track, Trials, step_chunk
from console.recording.format import Recording, Take
from world import random_streams
from world.character import model as character
from world.config import WorldConfig
from world.errors import ConfigError
from world.furniture.piece import Piece
from world.scene import perturbations
from world.scene.batch import Scenes
from world.scene.perturbations import Disturbance
from world.scene.target import Target

#: Trials stepped together: fixed, so that no figure depends on the number of threads.
CHUNK = 128


def require_distances(near_m: float, far_m: float) -> None:
    """Raise ConfigError, which names the flags, for initial distances that no trial can have."""
    if not 0.0 < near_m <= far_m:
        raise ConfigError(
            f"--near-m {near_m:g} --far-m {far_m:g}: the first must be above 0, the second no less"
        )


def manifest(
    pieces: Sequence[Piece],
    trials: int,
    seed: int,
    near_m: float = 1.0,
    far_m: float = 10.0,
    scale: tuple[float, float] = (0.8, 1.2),
    disturbance: Disturbance | None = None,
) -> Trials:
    """Return the trials of a seed: pieces in turn, the rest uniform (paper, section 7.1). A box is
    near_m to far_m from the character, and its target as far from the box."""
    u = (
        random_streams.uniform(seed, random_streams.TRIAL, torch.arange(trials), 0, 4)
        .double()
        .numpy()
    )
    low, high = scale
    return Trials(
        tuple(pieces[i % len(pieces)] for i in range(trials)),
        low + (high - low) * u[:, 0],
        near_m + (far_m - near_m) * u[:, 1],
        2 * np.pi * u[:, 2],
        2 * np.pi * u[:, 3],
        disturbance or perturbations.draw("none", trials, seed, 0),
        seed,
        (near_m, far_m),
    )


@dataclass(frozen=True)
class Results:
    """Results of m trials."""

    error_m: NDArray[np.float32]
    """[m, steps] error of the task after each step, m; infinite after the end."""
    fell_at: NDArray[np.int64]
    """[m] step that ended the trial by a fall or a non-finite state; `steps` without one."""
    reached: NDArray[np.bool_]
    """[m, stages] stages of the task that were true before the end."""
    disturbed: NDArray[np.int64]
    """[m] projectiles thrown before the end, or moves of the furniture."""
    broken: int
    """Number of trials whose state became non-finite."""
    tracks: list[Track]
    """Recorded trials."""

    @property
    def takes(self) -> list[Take]:
        """Takes of the recorded trials."""
        return [track.take for track in self.tracks]


def run(
    world: WorldConfig,
    weights: dict[str, Tensor],
    trials: Trials,
    steps: int,
    threads: int,
    record: int = 0,
    progress: Callable[[float], None] = lambda done: None,
    simulator: str = "mujoco",
) -> Results:
    """Return the results of all trials with the policy's mean actions; record the first
    `record`."""
    torch.set_num_threads(1)
    return drive(world, PolicyDriver(weights), trials, steps, threads, record, progress, simulator)


def drive(
    world: WorldConfig,
    driver: Driver,
    trials: Trials,
    steps: int,
    threads: int,
    record: int = 0,
    progress: Callable[[float], None] = lambda done: None,
    simulator: str = "mujoco",
) -> Results:
    """Return the results of all trials with any driver; record the first `record`.

    progress: takes the trials done, in which each control step of a trial counts as a part.
    """
    chunks = [range(i, min(i + CHUNK, len(trials))) for i in range(0, len(trials), CHUNK)]
    counts = dict.fromkeys(chunks, 0.0)

    def one(rows: range) -> Results:
        torch.set_num_threads(1)
        recorded = max(0, min(record - rows.start, len(rows)))

        def counted(scenes: Scenes, state: Tensor, goal: Tensor, target: Target) -> None:
            driver(scenes, state, goal, target)
            counts[rows] += len(rows) / steps
            progress(min(sum(counts.values()), len(trials)))

        part = step_chunk(world, counted, trials, rows, steps, recorded, simulator)
        counts[rows] = len(rows)
        progress(sum(counts.values()))
        return Results(
            part.error_m,
            part.fell_at,
            part.reached,
            part.disturbed,
            int(part.broken.sum()),
            part.tracks,
        )

    if simulator == "warp":
        threads = 1  # its launches are one queue
    with ThreadPoolExecutor(threads, "trials") as pool:
        parts = list(pool.map(one, chunks))
    return Results(
        np.concatenate([p.error_m for p in parts]),
        np.concatenate([p.fell_at for p in parts]),
        np.concatenate([p.reached for p in parts]),
        np.concatenate([p.disturbed for p in parts]),
        sum(p.broken for p in parts),
        [track for p in parts for track in p.tracks],
    )


def recording(results: Results, meta: dict[str, object]) -> Recording:
    """Return the recorded trials as a recording."""
    return Recording(results.takes, {"control_hz": character.CONTROL_HZ, **meta})
