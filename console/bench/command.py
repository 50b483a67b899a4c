"""`inhabit bench`: measurement of each part of training against its limit; keys end in units."""

import math
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import torch
from rich.table import Table
from torch import Tensor

from console.bench import box as bench_box
from console.bench import endurance as bench_endurance
from console.bench import furniture as bench_furniture
from console.bench import meanings
from console.bench import servos as bench_servos
from console.bench import warp_world as bench_warp_world
from console.bench import world as bench_world
from console.bench.peers import alternation, learning
from console.bench.turns import turns
from console.commands import Bench, Train
from console.run import assembly, machine, mixing
from console.run.directory import RunDirectory, write_json
from console.run.experiment import PRESETS, Experiment, check, with_learner_threads
from console.terminal import doing, progress, screen
from console.training.runners import open_runner, style_client
from discriminator.protocols import StyleScores
from learner.config import LoopConfig
from learner.loop import Loop
from policy.rollout import Rollout
from world import device as devices
from world import random_streams
from world.errors import ConfigError
from world.meshes import collection

#: Goals of whole iterations on two cores, samples/s, by preset.
GOAL_SAMPLES_PER_S = {"fast": 11_500.0, "paper": 7_500.0}
#: Ends of the names of figures that stand in brackets beside another.
SPREADS = (("_quartile_low", "_quartile_high"), ("_least", "_greatest"))


def bench_command(command: Bench) -> int:
    """Measure, print and write the JSON; return the exit code."""
    torch.set_num_threads(1)
    threads = command.threads or machine.cores()
    experiment = PRESETS[command.preset]
    world = replace(experiment.world, motions=tuple(str(p.resolve()) for p in command.motions))
    experiment = replace(
        experiment,
        world=world,
        scenes=command.scenes or experiment.scenes,
        device=command.device,
        simulator=command.simulator,
    )
    experiment = check(with_learner_threads(experiment, threads))

    def save(figures: Mapping[str, float], details: Mapping[str, Any]) -> None:
        result = {
            "name": command.part,
            "preset": command.preset,
            "machine": machine.describe(),
            "threads": threads,
            "scenes": experiment.scenes,
            "figures": figures,
            **details,
        }
        if command.json is not None:
            write_json(command.json, result)

    measure = {
        "world": world_figures,
        "servos": servos,
        "furniture": furniture,
        "box": box,
        "learner": learner,
        "style": style,
        "serve": serve,
        "train": train,
        "endurance": endurance,
        "scaling": scaling,
        "fuzz": fuzz,
        "peers": alternation.from_flags,
        "learning": partial(learning.from_flags, save=save),
        "profile": profile,
        "films": films,
    }
    with doing(f"measuring {command.part}"):
        found = measure[command.part](command, experiment, threads)
    figures, details = found if isinstance(found, tuple) else (found, {})
    screen().print(table(command.part, figures))
    save(figures, details)
    return 0


def table(part: str, figures: Mapping[str, float]) -> Table:
    """Return the figures with their meanings, and whether they meet the limits stated for them.

    The quartiles of a figure, or its least and greatest, stand beside it, in brackets.
    """
    shown = Table("figure", "", "meaning", "limit", title=f"bench {part}", title_justify="left")
    for name, value in figures.items():
        if name.endswith(tuple(end for pair in SPREADS for end in pair)):
            continue
        text = f"{value:,.4g}"
        for first, last in SPREADS:
            if f"{name}{first}" in figures:
                text += f" ({figures[f'{name}{first}']:,.4g}-{figures[f'{name}{last}']:,.4g})"
        shown.add_row(name, text, meanings.meaning(name), meanings.verdict(name, figures))
    return shown


def world_figures(command: Bench, experiment: Experiment, _threads: int) -> dict[str, float]:
    """Measure a control step of a shard against that of the raw simulator, from the same states."""
    if experiment.simulator == "warp":
        device = devices.resolve(experiment.device).torch
        return bench_warp_world.measure(experiment, command.seconds, device)
    return bench_world.measure(experiment, command.seconds)


def servos(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Measure random actions for ten minutes per scene, or as long as the time allows."""
    return bench_servos.measure(experiment, command.seconds, threads)


def furniture(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Measure scenes with a mixture of pieces against scenes with a plain chair."""
    pieces = collection.pieces(command.objects)
    if not pieces:
        raise ConfigError(f"--objects: name {', '.join(collection.SPLITS)} or a path of pieces")
    return bench_furniture.measure(pieces, experiment.scenes, command.seconds, threads)


def fuzz(command: Bench, _experiment: Experiment, threads: int) -> dict[str, float]:
    """Count the results of readers on randomly damaged files, which must be read or refused in one
    line."""
    from console.bench.fuzzing import survey as bench_fuzz

    with progress("mutations", command.mutations) as note:
        figures, faults = bench_fuzz.survey(command.mutations, threads, note=note)
    for line in bench_fuzz.shown(faults):
        print(line, file=sys.stderr)
    return figures


def box(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Measure scenes with a carried box, by contact settings."""
    return bench_box.measure(experiment.scenes, command.seconds, threads)


def learner(command: Bench, experiment: Experiment, _threads: int) -> dict[str, float]:
    """Measure one PPO update on random samples."""
    device = devices.resolve(experiment.device).torch
    # random means are far from the actor's: without this every step would be skipped
    experiment = replace(experiment, ppo=replace(experiment.ppo, kl_skip=1e9))
    student = assembly.learner(warmed(experiment), device)
    rollout = made_up(experiment).on(device)
    spent = repeated(lambda: student.update(rollout, rollout.rewards, student.sigma), command)
    student.close()
    return {
        "update_s": spent,
        "update_us_per_sample": 1e6 * spent / rollout.samples,
        "samples": float(rollout.samples),
        "epochs": float(experiment.ppo.epochs),
    }


def style(command: Bench, experiment: Experiment, _threads: int) -> dict[str, float]:
    """Measure scoring over gRPC against scoring in process, on the same batches."""
    rollout = made_up(experiment)
    here = assembly.discriminator(experiment)
    counter = iter(range(1, 1 << 30))

    def score(at: Any) -> StyleScores:
        return at.score(
            next(counter), rollout.states, rollout.end_index, rollout.end_states, rollout.valid
        )

    in_process = repeated(lambda: score(here), command)
    training = repeated(lambda: here.train(here.version), command)
    with tempfile.TemporaryDirectory() as folder:
        run = RunDirectory(Path(folder))
        with style_client(experiment, run, print) as client:
            over_grpc = repeated(lambda: score(client), command)
    iteration = rollout.samples / GOAL_SAMPLES_PER_S[command.preset]
    return {
        "in_process_ms": 1e3 * in_process,
        "grpc_ms": 1e3 * over_grpc,
        "transport_ms": 1e3 * (over_grpc - in_process),
        "train_ms": 1e3 * training,
        "iteration_at_goal_ms": 1e3 * iteration,
        "transport_of_iteration_ratio": (over_grpc - in_process) / iteration,
        "grpc_to_in_process_ratio": over_grpc / in_process,
    }


def serve(command: Bench, experiment: Experiment, _threads: int) -> dict[str, float]:
    """Measure the policy service on one core against a gRPC echo and Ray Serve's gRPC ingress."""
    from console.bench import serve as bench_serve  # needs Ray, which the others can do without

    return bench_serve.measure(experiment, command.seconds / 3)


def train(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Measure whole iterations, their parts, and the ratio of each part to itself alone."""
    command_of_training = Train(
        task=experiment.world.task, experiment=experiment, runner=command.runner, threads=threads
    )
    device = devices.resolve(experiment.device).torch
    student = assembly.learner(warmed(experiment), device)
    sums: dict[str, float] = {}
    count = 0
    with tempfile.TemporaryDirectory() as folder:
        run = RunDirectory(Path(folder))
        with open_runner(command_of_training, experiment, run, threads, print, device) as runner:
            terms = mixing.term_names(experiment)
            loop = Loop(student, runner.fleet, runner.style, Null(), Null(), LoopConfig(), terms)
            for _ in range(3):
                loop.iterate()
            began = time.perf_counter()
            for turn in turns(command.seconds, 3):
                for name, value in loop.iterate().items():
                    sums[name] = sums.get(name, 0.0) + value
                count = turn + 1
            wall = time.perf_counter() - began
            memory, on_device = machine.process_tree_gb(), devices.memory_used(device)
            loop.close()
    part = {name: sums[f"rate/{name}_s"] / count for name in ("world", "policy", "style", "update")}
    samples = experiment.scenes * experiment.horizon
    rate = samples * count / wall
    alone = limits(command, experiment, threads)
    return {
        "samples_per_s": rate,
        "goal_samples_per_s": GOAL_SAMPLES_PER_S[command.preset],
        "to_goal_ratio": rate / GOAL_SAMPLES_PER_S[command.preset],
        "iteration_s": wall / count,
        "gather_s": sums["rate/gather_s"] / count,
        **{f"{name}_s": value for name, value in part.items()},
        **{f"{name}_alone_s": value for name, value in alone.items()},
        **{f"{name}_to_limit_ratio": alone[name] / part[name] for name in part},
        "resident_gb": memory,
        "device_gb": on_device / 1e9,
    }


def endurance(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Measure the memory of every process over a training."""
    return bench_endurance.measure(experiment, command.runner, threads, command.seconds)


def scaling(command: Bench, experiment: Experiment, _threads: int) -> dict[str, float]:
    """Measure the learner's intake from 1 to 200 stand-in actors, and the gain of overlapping."""
    from console.bench import scaling as bench_scaling  # imports Ray, which the others do not need

    scenes = command.scenes or experiment.scenes // 2  # those of each of two actors of `train`
    return bench_scaling.measure(experiment, scenes, command.seconds)


def profile(command: Bench, _experiment: Experiment, threads: int) -> dict[str, float]:
    """Measure the processor time of a training iteration by part."""
    from console.bench import profile as bench_profile

    return bench_profile.measure(command.policy, command.seconds, threads)


def films(command: Bench, _experiment: Experiment, threads: int) -> dict[str, float]:
    """Measure the writing of a film in one drawing process and in several."""
    from console.bench import films as bench_films  # needs OpenGL

    return bench_films.measure(command.policy, command.seconds, threads)


def limits(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Return the seconds of each part of an iteration, measured alone.

    World: the raw batch on one thread, divided by the threads. Policy: the forward passes. Style:
    scoring and training in process. Update: PPO on random samples.
    """
    raw = world_figures(replace(command, seconds=command.seconds / 4), experiment, threads)
    raw = raw["raw_control_steps_per_s"] * (threads if experiment.simulator == "mujoco" else 1)
    samples = experiment.scenes * experiment.horizon
    short = replace(command, seconds=command.seconds / 4)
    here = style_alone(experiment, short)
    return {
        "world": samples / raw,
        "policy": policy_alone(experiment, short) / threads,
        "style": here,
        "update": learner(short, experiment, threads)["update_s"],
    }


def policy_alone(experiment: Experiment, command: Bench) -> float:
    """Return the seconds of one iteration's forward passes and noise on one thread."""
    from policy.model.acting import Policy

    student = assembly.learner(experiment)
    policy = Policy(student.weights(), student.precision)
    student.close()
    rollout = made_up(experiment)
    ids = torch.arange(experiment.block)

    def act() -> None:
        for t in range(experiment.horizon):
            for first in range(0, experiment.scenes, experiment.block):
                rows = slice(first, first + experiment.block)
                policy(rollout.states[t, rows], rollout.goals[t, rows])
                random_streams.normal(0, ids, t, policy.actions)

    return repeated(act, command)


def style_alone(experiment: Experiment, command: Bench) -> float:
    """Return the seconds of scoring one rollout and training on it, in process."""
    device = devices.resolve(experiment.device).torch
    here = assembly.discriminator(experiment, device=device)
    rollout = made_up(experiment).on(device)
    counter = iter(range(1, 1 << 30))

    def once() -> None:
        here.score(
            next(counter), rollout.states, rollout.end_index, rollout.end_states, rollout.valid
        )
        here.train(here.version)

    return repeated(once, command)


class Null:
    """A recorder and checkpoint store that discards everything."""

    def record(self, iteration: int, metrics: Any) -> None:
        """Discard metrics."""

    def save(self, iteration: int, state: Any, best: bool = False) -> None:
        """Discard a checkpoint."""


def warmed(experiment: Experiment) -> Experiment:
    """Return the experiment without its warm-up, which trains the critic alone."""
    return replace(experiment, ppo=replace(experiment.ppo, warmup_iterations=0))


def repeated(once: Callable[[], Any], command: Bench) -> float:
    """Return the seconds of one call: the median of calls over a third of --seconds."""
    once()
    spent: list[float] = []
    for _ in turns(command.seconds / 3, 5):
        before = time.perf_counter()
        once()
        spent.append(time.perf_counter() - before)
    return sorted(spent)[len(spent) // 2]


def made_up(experiment: Experiment) -> Rollout:
    """Return a rollout of random numbers from a fixed seed, without ends of episodes."""
    layout = assembly.layout(experiment)
    draw = torch.Generator().manual_seed(0)
    steps, n = experiment.horizon, experiment.scenes
    state = sum(width for _, width in layout.features)
    sigma = experiment.ppo.sigma[0][1]

    def normal(*shape: int) -> Tensor:
        return torch.randn(shape, generator=draw)

    means = 0.1 * normal(steps, n, layout.actions)
    noise = normal(steps, n, layout.actions)
    width = layout.actions
    log_probs = -0.5 * noise.square().sum(-1) - width * (
        math.log(sigma) + 0.5 * math.log(2 * math.pi)
    )
    none = torch.zeros(steps, n, dtype=torch.bool)
    goal = layout.observation - state
    return Rollout(
        states=normal(steps + 1, n, state),
        goals=normal(steps + 1, n, goal),
        actions=means + sigma * noise,
        means=means,
        log_probs=log_probs,
        rewards=normal(steps, n),
        term_sums=torch.zeros(n, 1, dtype=torch.float64),
        fell=none,
        timed_out=none,
        valid=~none,
        end_index=torch.zeros(0, 2, dtype=torch.int64),
        end_states=torch.zeros(0, state),
        end_goals=torch.zeros(0, goal),
        episodes={key: torch.zeros(0) for key in ("return", "length", "success", "fall", "start")},
        version=0,
        first_scene=0,
        seconds={"world": 0.0, "policy": 0.0},
    )
