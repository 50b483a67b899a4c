"""`inhabit bench`: each part of training against its own limit; keys end in units."""

import math
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from rich.table import Table
from torch import Tensor

from console.bench import box as bench_box
from console.bench import endurance as bench_endurance
from console.bench import furniture as bench_furniture
from console.bench import serve as bench_serve
from console.bench import servos as bench_servos
from console.bench import world as bench_world
from console.commands import Bench, Train
from console.run import assembly, machine
from console.run.directory import RunDirectory, write_json
from console.run.experiment import PRESETS, Experiment, check, with_learner_threads
from console.terminal import screen
from console.training.runners import open_runner, style_client
from discriminator.protocols import StyleScores
from learner.config import LoopConfig
from learner.loop import Loop
from policy.rollout import Rollout
from world import random_streams, tasks
from world.meshes import collection

#: Whole iterations that issue and design hold this machine class to, samples/s, by preset.
GOAL_SAMPLES_PER_S = {"fast": 11_500.0, "paper": 7_500.0}


def bench_command(command: Bench) -> int:
    """Measure, print, and write the JSON of console.md; returns the exit code."""
    torch.set_num_threads(1)
    threads = command.threads or machine.cores()
    experiment = PRESETS[command.preset]
    world = replace(experiment.world, motions=tuple(str(p.resolve()) for p in command.motions))
    experiment = replace(experiment, world=world, scenes=command.scenes or experiment.scenes)
    experiment = check(with_learner_threads(experiment, threads))
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
    }
    figures = measure[command.part](command, experiment, threads)
    result = {
        "name": command.part,
        "preset": command.preset,
        "machine": machine.describe(),
        "threads": threads,
        "scenes": experiment.scenes,
        "figures": figures,
    }
    table = Table("figure", "", title=f"bench {command.part}", title_justify="left")
    for name, value in figures.items():
        table.add_row(name, f"{value:,.4g}")
    screen().print(table)
    if command.json is not None:
        write_json(command.json, result)
    return 0


def world_figures(command: Bench, experiment: Experiment, _threads: int) -> dict[str, float]:
    """A control step of a shard against the raw batch's, from the same states."""
    return bench_world.measure(experiment, command.seconds)


def servos(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Random actions for ten minutes a scene, or as much of it as the time allows."""
    return bench_servos.measure(experiment, command.seconds, threads)


def furniture(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Scenes on any mixture of pieces against scenes on a plain chair."""
    pieces = collection.pieces(command.objects)
    return bench_furniture.measure(pieces, experiment.scenes, command.seconds, threads)


def fuzz(command: Bench, _experiment: Experiment, threads: int) -> dict[str, float]:
    """Readers against randomly damaged files: all must be read or refused in one line."""
    from console.bench import fuzz as bench_fuzz

    figures, faults = bench_fuzz.survey(command.mutations, threads)
    for line in bench_fuzz.shown(faults):
        print(line, file=sys.stderr)
    return figures


def box(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Scenes in which a box is carried, by how their contacts are solved."""
    return bench_box.measure(experiment.scenes, command.seconds, threads)


def learner(command: Bench, experiment: Experiment, _threads: int) -> dict[str, float]:
    """One PPO update on made-up samples."""
    student = assembly.learner(warmed(experiment))
    rollout = made_up(experiment)
    spent = repeated(lambda: student.update(rollout, rollout.rewards, student.sigma), command)
    student.close()
    return {
        "update_s": spent,
        "update_us_per_sample": 1e6 * spent / rollout.samples,
        "samples": float(rollout.samples),
        "epochs": float(experiment.ppo.epochs),
    }


def style(command: Bench, experiment: Experiment, _threads: int) -> dict[str, float]:
    """Scoring over gRPC against scoring in process, the same batches."""
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
    """The policy service on one core against a bare gRPC echo and Ray Serve's gRPC ingress."""
    return bench_serve.measure(experiment, command.seconds / 3)


def train(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Whole iterations, their split, and each part's ratio to itself running alone."""
    asked = Train(
        task=experiment.world.task, experiment=experiment, runner=command.runner, threads=threads
    )
    student = assembly.learner(warmed(experiment))
    sums: dict[str, float] = {}
    count = 0
    with tempfile.TemporaryDirectory() as folder:
        run = RunDirectory(Path(folder))
        with open_runner(asked, experiment, run, threads, print) as runner:
            terms = list(tasks.make(experiment.world.task).terms)
            loop = Loop(
                student, runner.fleet, runner.style, Nowhere(), Nowhere(), LoopConfig(), terms
            )
            for _ in range(3):
                loop.iterate()
            began = time.perf_counter()
            while time.perf_counter() - began < command.seconds or count < 3:
                for name, value in loop.iterate().items():
                    sums[name] = sums.get(name, 0.0) + value
                count += 1
            wall = time.perf_counter() - began
            memory = machine.process_tree_gb()
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
    }


def endurance(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Memory of every process over a training of so many seconds."""
    return bench_endurance.measure(experiment, command.runner, threads, command.seconds)


def scaling(command: Bench, experiment: Experiment, _threads: int) -> dict[str, float]:
    """What the learner takes in from 1 to 200 stand-in actors, and what overlapping gains."""
    from console.bench import scaling as bench_scaling  # needs Ray, which the others can do without

    scenes = command.scenes or experiment.scenes // 2  # as each of two actors of `train` has
    return bench_scaling.measure(experiment, scenes, command.seconds)


def limits(command: Bench, experiment: Experiment, threads: int) -> dict[str, float]:
    """Seconds an iteration of each part, with nothing beside it.

    World: the raw batch on one thread, shared by the threads. Policy: the forward passes. Style:
    scoring and training in process. Update: PPO on made-up samples.
    """
    raw = bench_world.measure(experiment, command.seconds / 4)["raw_control_steps_per_s"]
    samples = experiment.scenes * experiment.horizon
    short = replace(command, seconds=command.seconds / 4)
    here = style_alone(experiment, short)
    return {
        "world": samples / raw / threads,
        "policy": policy_alone(experiment, short) / threads,
        "style": here,
        "update": learner(short, experiment, threads)["update_s"],
    }


def policy_alone(experiment: Experiment, command: Bench) -> float:
    """Seconds of one iteration's forward passes and noise on one thread."""
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
    """Seconds of scoring one rollout and training on it, in process."""
    here, rollout = assembly.discriminator(experiment), made_up(experiment)
    counter = iter(range(1, 1 << 30))

    def once() -> None:
        here.score(
            next(counter), rollout.states, rollout.end_index, rollout.end_states, rollout.valid
        )
        here.train(here.version)

    return repeated(once, command)


class Nowhere:
    """Keeps no records and no checkpoints."""

    def record(self, iteration: int, metrics: Any) -> None:
        """Nothing."""

    def save(self, iteration: int, state: Any, best: bool = False) -> None:
        """Nothing."""


def warmed(experiment: Experiment) -> Experiment:
    """The experiment without its warm-up, which would measure the critic alone."""
    return replace(experiment, ppo=replace(experiment.ppo, warmup_iterations=0))


def repeated(once: Callable[[], Any], command: Bench) -> float:
    """Seconds of one call: the median of calls over about a third of the time asked for."""
    once()
    spent: list[float] = []
    began = time.perf_counter()
    while len(spent) < 5 or time.perf_counter() - began < command.seconds / 3:
        before = time.perf_counter()
        once()
        spent.append(time.perf_counter() - before)
    return sorted(spent)[len(spent) // 2]


def made_up(experiment: Experiment) -> Rollout:
    """A rollout of the right shapes with random numbers, no episode ending, from one fixed seed."""
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
