"""DAgger's own process: what it learns from the labels of its workers, and what it reports."""

import queue
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from console.commands.teaching import Dagger
from console.run import assembly
from console.run.experiment import Experiment
from console.teaching import dagger
from learner.config import LearnerConfig
from tests.support.learning.learners import same
from world.config import WorldConfig
from world.errors import InhabitError


class Alive:
    exitcode = None

    def is_alive(self) -> bool:
        return True


def test_a_student_of_one_side_learns_the_same_from_both(tmp_path: Path) -> None:
    """A policy of lie acts on one side of the bed and mirrors the other: labels of the other side
    are labels of its own, and its normaliser never sees the other."""
    experiment = Experiment(world=WorldConfig(task="lie"), ppo=LearnerConfig(hidden=(16, 8)))
    settings = Dagger(minutes=60.0, batches=3, batch=32, first=64, capacity=256)
    draw = torch.Generator().manual_seed(0)
    width = assembly.layout(experiment).observation
    seen, wanted = (torch.randn(64, n, generator=draw) for n in (width, 28))
    policies = []
    for other in (False, True):
        learner = assembly.learner(experiment)
        sides = learner.symmetry
        assert sides is not None
        _, right = sides.canonical(seen)
        assert right is not None and 0.2 < float(right.float().mean()) < 0.8
        found = (sides.observation(seen), sides.action(wanted)) if other else (seen, wanted)
        labels: queue.Queue[list[np.ndarray]] = queue.Queue()
        labels.put([part.numpy() for part in (*found, torch.zeros(0, 3))])
        workers = dagger.Workers(
            labels, SimpleNamespace(value=1.0), tmp_path / "student", [Alive()]
        )
        lesson = dagger.Lesson([], experiment, learner, False, (), {})
        torch.manual_seed(0)
        dagger._regress(tmp_path / "out", settings, lesson, workers)
        policies.append(learner.policy_state())
        learner.close()
        canonical, _ = sides.canonical(seen)
        torch.testing.assert_close(learner.normaliser.mean, canonical.double().mean(dim=0))
    assert same(*policies)


class Ended:
    exitcode = 3

    def is_alive(self) -> bool:
        return False


def test_a_worker_that_ended_is_one_clear_line() -> None:
    workers = dagger.Workers(None, None, Path(), [Ended()])
    with pytest.raises(InhabitError, match="a worker process ended with exit code 3"):
        workers.check()


def test_a_line_says_how_far_it_is_and_how_the_student_does() -> None:
    line = {"minutes": 1.26, "samples": 374240, "batches": 9, "error": 0.0412, "spell": 22.3}
    assert dagger.described(line, 5.0) == (
        "1.3 of 5 min  374,240 labels  error 0.041  student drives 22 steps at a time"
    )
    alone = {
        "student/episodes": 52,
        "student/steps": 99.0,
        "student/fell": 0.46,
        "student/seated": 0.3,
    }
    assert dagger.described(line | alone | {"mixed/fell": 1.0}, 5.0).endswith(
        "at a time  alone in 52 episodes: fell 46 %, seated 30 %"
    )
