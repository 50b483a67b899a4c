"""Trials: which piece stands where, fixed by a seed, and what a policy does with each of them."""

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
from world.furniture.piece import Piece
from world.scene import perturbations
from world.scene.perturbations import Disturbance

#: Trials stepped together: fixed, so that no figure depends on the number of threads.
CHUNK = 128
#: Key of these draws among the streams (world.random_streams names its own from 1).
PURPOSE = 101


def manifest(
    pieces: Sequence[Piece],
    trials: int,
    seed: int,
    near_m: float = 1.0,
    far_m: float = 10.0,
    scale: tuple[float, float] = (0.8, 1.2),
    disturbance: Disturbance | None = None,
) -> Trials:
    """The trials of a seed: pieces in turn, the rest uniform (paper, section 7.1). A box is near_m
    to far_m from the character, and its target from the box."""
    u = random_streams.uniform(seed, PURPOSE, torch.arange(trials), 0, 4).double().numpy()
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
    """What happened, a row a trial."""

    error_m: NDArray[np.float32]
    """[m, steps]: the task's error after each step, m; infinite where it was not measured."""
    fell_at: NDArray[np.int64]
    """[m]: the step that ended the trial by a fall (or a blow-up); `steps` for none."""
    reached: NDArray[np.bool_]
    """[m, stages]: stages of the task that were true before the end."""
    disturbed: NDArray[np.int64]
    """[m]: projectiles thrown before the end, or moves of the furniture."""
    broken: int
    """Trials that the simulator gave up."""
    tracks: list[Track]
    """Of the trials that were to be recorded."""

    @property
    def takes(self) -> list[Take]:
        """The recorded trials as takes."""
        return [track.take for track in self.tracks]


def run(
    world: WorldConfig,
    weights: dict[str, Tensor],
    trials: Trials,
    steps: int,
    threads: int,
    record: int = 0,
    progress: Callable[[int], None] = lambda done: None,
    simulator: str = "mujoco",
) -> Results:
    """Run all trials with the policy's mean actions; the first `record` are recorded."""
    torch.set_num_threads(1)
    return drive(world, PolicyDriver(weights), trials, steps, threads, record, progress, simulator)


def drive(
    world: WorldConfig,
    driver: Driver,
    trials: Trials,
    steps: int,
    threads: int,
    record: int = 0,
    progress: Callable[[int], None] = lambda done: None,
    simulator: str = "mujoco",
) -> Results:
    """As `run`, of whatever drives the characters."""
    chunks = [range(i, min(i + CHUNK, len(trials))) for i in range(0, len(trials), CHUNK)]
    done = 0

    def one(rows: range) -> Results:
        nonlocal done
        torch.set_num_threads(1)
        recorded = max(0, min(record - rows.start, len(rows)))
        part = step_chunk(world, driver, trials, rows, steps, recorded, simulator)
        done += len(rows)
        progress(done)
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
    """The recorded trials with what made them."""
    return Recording(results.takes, {"control_hz": character.CONTROL_HZ, **meta})
