"""The protocol of a peer's process: assignment, turns, and what a library prints."""

import json
import os
import random
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import torch

from console.bench.peers import protocol
from console.bench.peers.protocol import Assignment, Iterate
from console.run.experiment import PRESETS
from tests.support.paths import ROOT

ASSIGNMENT = Assignment(replace(PRESETS["fast"], seed=7), 2)


def test_an_assignment_is_the_same_after_json() -> None:
    text = json.dumps(ASSIGNMENT.to_json())
    assert Assignment.from_json(json.loads(text)) == ASSIGNMENT


def test_the_batch_is_that_of_the_learner() -> None:
    assert (ASSIGNMENT.batch, ASSIGNMENT.minibatches) == (512 * 8, 2)
    assert ASSIGNMENT.sigma == 0.05
    ppo = replace(ASSIGNMENT.experiment.ppo, minibatch=10_000)
    assert Assignment(replace(ASSIGNMENT.experiment, ppo=ppo), 1).minibatches == 1


def answers(turns: int) -> tuple[list[dict], list[str]]:
    """The answers to an assignment and turns of 0 s, and what happened in order."""
    seen: list[str] = []

    @contextmanager
    def open_peer(assignment: Assignment) -> Iterator[Iterate]:
        assert assignment == ASSIGNMENT
        seen.append("open")

        def iterate() -> int:
            seen.append("iteration")
            return 100

        yield iterate
        seen.append("close")

    questions = [json.dumps(ASSIGNMENT.to_json())] + ['{"seconds": 0.0}'] * turns
    written = StringIO()
    protocol.answer(open_peer, StringIO("\n".join(questions)), written)
    return [json.loads(line) for line in written.getvalue().splitlines()], seen


def test_iterations_before_ready_are_not_counted() -> None:
    found, seen = answers(0)
    assert found == [{"ready": True}]
    assert seen == ["open", *["iteration"] * protocol.WARM_ITERATIONS, "close"]


def test_a_turn_has_an_iteration_at_least() -> None:
    (_, *turns), seen = answers(2)
    assert len(turns) == 2 and seen.count("iteration") == protocol.WARM_ITERATIONS + 2
    for turn in turns:
        assert turn["samples"] == 100 and turn["iterations"] == 1 and turn["seconds"] > 0.0
        assert 0.0 < turn["resident_gb"] <= turn["peak_gb"]


def test_a_curve_begins_with_the_first_sample(tmp_path: Path) -> None:
    """Iterations of 100 samples, whose scenes count two control steps each, an episode a step."""
    given = replace(ASSIGNMENT, counters=str(tmp_path))
    seen: list[float] = []

    @contextmanager
    def open_peer(assignment: Assignment) -> Iterator[Iterate]:
        seen.extend((random.random(), np.random.random(), float(torch.rand(()))))  # noqa: NPY002
        counts = np.zeros(5)

        def iterate() -> int:
            counts[:] += (2, 0.5, 2, 3.0, 1)
            np.save(tmp_path / "0.npy", counts)
            return 100

        yield iterate

    def curve(ends: list[int]) -> list[dict]:
        questions = [json.dumps(given.to_json()), *(json.dumps({"samples": n}) for n in ends)]
        written = StringIO()
        protocol.answer(open_peer, StringIO("\n".join(questions)), written)
        return [json.loads(line) for line in written.getvalue().splitlines()]

    ready, *windows = curve([250, 500])
    assert ready == {"ready": True}
    for window in windows:
        window.pop("seconds")
    assert windows == [
        {"samples": 300, "control_steps": 6, "reward": 1.5, "episodes": 6, "returns": 9.0,
         "falls": 3},
        {"samples": 500, "control_steps": 4, "reward": 1.0, "episodes": 4, "returns": 6.0,
         "falls": 2},
    ]  # fmt: skip
    (tmp_path / "0.npy").unlink()
    curve([100])
    assert seen[:3] == seen[3:], "generators begin with the experiment's seed"
    given = replace(given, experiment=replace(given.experiment, seed=8))
    curve([100])
    assert not {*seen[:3]} & {*seen[6:]}


def test_a_turn_goes_on_until_its_time(monkeypatch) -> None:
    clock = iter([10.0, 11.0, 12.5, 13.0])
    monkeypatch.setattr(protocol.time, "perf_counter", lambda: next(clock))
    monkeypatch.setattr(protocol.machine, "process_tree_seconds", iter([5.0, 9.0]).__next__)
    turn = protocol.turn(lambda: 50, 3.0)
    assert (turn.iterations, turn.samples, turn.seconds, turn.processor_s) == (3, 150, 3.0, 4.0)
    assert turn.rate == 50.0 and turn.processor_rate == 37.5


def test_what_a_library_prints_is_no_answer() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.peers.printing"],
        input=json.dumps(ASSIGNMENT.to_json()) + '\n{"seconds": 0.0}\n',
        capture_output=True,
        text=True,
        env=dict(os.environ, PYTHONPATH=str(ROOT)),
        check=True,
    )
    ready, turn = map(json.loads, done.stdout.splitlines())
    assert ready == {"ready": True} and turn["samples"] == ASSIGNMENT.batch
    assert done.stderr.count("of the library") == protocol.WARM_ITERATIONS + 1
