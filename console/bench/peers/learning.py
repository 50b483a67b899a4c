"""`inhabit bench learning`: how much a sample teaches, ours and the peers, on the task walk.

Each library trains from random weights on the same scenes, one training after the other, each in a
process of its own (protocol.py). What its episodes earn is counted in the scenes (counters.py).
"""

import importlib.metadata
import json
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from console.bench.peers.alternation import (
    Note,
    PeerError,
    Start,
    installed,
    interpreters_of,
    started,
)
from console.bench.peers.curves import Run, Window, ends, figures_of, marks
from console.bench.peers.protocol import Assignment
from console.bench.peers.registry import NAMES, OURS, OURS_EQUAL
from console.commands import Bench
from console.run.experiment import Experiment, differences, to_json
from console.terminal import progress
from world import tasks
from world.errors import ChoiceError, ConfigError
from world.tasks.walk import Walk

#: In the order in which they are trained, for each seed.
LEARNERS = (OURS, *NAMES, OURS_EQUAL)

#: Receives figures and details whenever a training is complete.
Save = Callable[[dict[str, float], dict[str, Any]], None]


@dataclass(frozen=True)
class Plan:
    """What is trained; `kept` runs of other plans are refused."""

    experiment: Experiment
    """The peers' experiment; the seed is replaced."""
    samples: int
    threads: int

    def to_json(self) -> dict[str, Any]:
        """Return the plan as JSON values."""
        own = {"samples": self.samples, "threads": self.threads}
        return {**own, "experiment": to_json(self.experiment)}

    def assignment(self, name: str, seed: int, counters: str) -> Assignment:
        """Return what the process of a library is given."""
        experiment = replace(self.experiment, seed=seed)
        if name == OURS_EQUAL:
            experiment = equal(experiment)
        return Assignment(experiment, self.threads, counters)


def walk(preset: Experiment) -> Experiment:
    """Return the experiment of the comparison: walk to a point, by the task reward alone.

    Episodes begin in the rest pose, with the target at the preset's distances: no clip is needed.
    Success ends none: an episode that ended with it would return less, the sooner it succeeded.
    """
    initial = replace(preset.world.initial, reference=0.0, standing_fraction=1.0)
    time = preset.world.episode_s or tasks.make(Walk.name).episode_s
    world = replace(preset.world, task=Walk.name, initial=initial, episode_s=time, hold_s=time)
    # the critic's warm-up is for actors that are cloned or loaded
    ppo = replace(preset.ppo, task_weight=1.0, style_weight=0.0, warmup_iterations=0)
    return replace(preset, world=world, ppo=ppo)


def equal(experiment: Experiment) -> Experiment:
    """Return the experiment with the peers' learning rate for actor and critic, throughout."""
    rate = experiment.ppo.actor_rate
    ppo = replace(experiment.ppo, actor_rate_bounds=(rate, rate), critic_rate=rate)
    return replace(experiment, ppo=ppo)


def from_flags(
    command: Bench, preset: Experiment, threads: int, save: Save
) -> tuple[dict[str, float], dict[str, Any]]:
    """Measure the returns of ours and of other libraries at equal samples."""
    return measure(
        preset,
        threads,
        command.samples,
        command.seeds,
        command.only,
        command.peer_python,
        command.json,
        save,
    )


def measure(
    preset: Experiment,
    threads: int,
    samples: int,
    seeds: int,
    only: Sequence[str],
    interpreters: Sequence[str],
    file: Path | None,
    save: Save,
    note: Note = print,
) -> tuple[dict[str, float], dict[str, Any]]:
    """Return the figures of all runs, and what the results page needs beside: the curves.

    samples: of each training; figures are at a fifth, half and all of them. only: names of
    LEARNERS; empty: all. interpreters: NAME=PATH, as for `bench peers`. file: JSON of an earlier
    call, whose runs are not repeated; none, or absent: nothing is. note: receives a line for each
    run, and for each library that is left out.

    Raises ChoiceError for an unknown name, ConfigError for too few samples or a file of something
    else, PeerError where nothing could be trained.
    """
    plan = Plan(walk(preset), samples, threads)
    batch = plan.assignment(OURS, 0, "").batch
    if not ends(samples, batch):
        raise ConfigError(
            f"--samples {samples}: must be {10 * batch} or above, ten iterations of {batch}"
        )
    names = chosen(only)
    paths = interpreters_of(interpreters)
    runs, before = kept(file, plan)
    seeds_of_all = max(seeds, before)

    def found() -> tuple[dict[str, float], dict[str, Any]]:
        ordered = sorted(runs, key=lambda run: (run.seed, LEARNERS.index(run.name)))
        details = {
            "plan": plan.to_json(),
            "seeds": seeds_of_all,
            "runs": [run.to_json() for run in ordered],
        }
        return figures_of(ordered, samples), details

    versions = versions_of(names, paths, note)
    complete = {(run.name, run.seed) for run in runs}
    wanted = [
        (name, seed) for seed in range(seeds) for name in versions if (name, seed) not in complete
    ]
    for name, seed in wanted:
        try:
            run = trained(name, seed, versions[name], paths, plan)
        except PeerError as error:
            note(f"{name}, seed {seed}: not measured: {error}")
            continue
        runs.append(run)
        save(*found())
        note(line(run, samples))
    if not runs:
        raise PeerError("bench learning: every training failed; see the lines above")
    return found()


def chosen(only: Sequence[str]) -> list[str]:
    """Return the names in the order of LEARNERS; ChoiceError for an unknown one."""
    for name in only:
        if name not in LEARNERS:
            raise ChoiceError("--only", name, list(LEARNERS))
    return [name for name in LEARNERS if name in only or not only]


def versions_of(names: Sequence[str], paths: Mapping[str, Path], note: Note) -> dict[str, str]:
    """Return the version of each that can be trained, in order; PeerError without any."""
    peers = [name for name in names if name in NAMES]
    ours = importlib.metadata.version("inhabit")
    found = {name: ours for name in names if name not in NAMES}
    if peers:
        found |= installed(paths, note, peers, required=not found)
    return {name: found[name] for name in names if name in found}


def kept(file: Path | None, plan: Plan) -> tuple[list[Run], int]:
    """Return the runs of an earlier call, and its number of seeds; ConfigError where the file holds
    something else, or curves of other settings."""
    if file is None or not file.exists():
        return [], 0
    try:
        value = json.loads(file.read_text())
        runs = [Run.from_json(run) for run in value["runs"]]
        earlier, seeds = dict(value["plan"]), int(value["seeds"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(
            f"--json {file}: exists, and holds no curves of bench learning: name another file"
        ) from error
    changed = list(differences(earlier, plan.to_json()))
    if changed:
        raise ConfigError(
            f"--json {file}: its curves are of other settings ({'; '.join(changed)}): name another"
            " file"
        )
    return runs, seeds


def module(name: str) -> str:
    """Return the module whose process trains a library."""
    return f"console.bench.peers.{name if name in NAMES else 'ours'}"


def trained(name: str, seed: int, version: str, paths: Mapping[str, Path], plan: Plan) -> Run:
    """Train a library from random weights; PeerError where its process fails."""
    with tempfile.TemporaryDirectory() as folder:
        assignment = plan.assignment(name, seed, folder)
        interpreter = paths.get(name, Path(sys.executable))
        start = Start(name, module(name), interpreter, assignment.to_json())
        windows: list[Window] = []
        with (
            progress(f"samples of {name}, seed {seed}", plan.samples) as done,
            started(start) as running,
        ):
            for end in ends(plan.samples, assignment.batch):
                running.write({"samples": end})
                windows.append(Window(**running.read()))
                done(windows[-1].samples)
    return Run(name, seed, version, tuple(windows))


def line(run: Run, samples: int) -> str:
    """Return a line on a complete run."""
    figures = figures_of([run], samples)
    at = [
        f"{figures[name]:.2f} at {mark:,}"
        for mark in marks(samples)
        if (name := f"{run.name}_at_{mark}_return") in figures
    ]
    return f"{run.name}, seed {run.seed}: return {', '.join(at)}; {run.rate:,.0f} samples/s"
