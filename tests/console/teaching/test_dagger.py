"""`inhabit teach carry`: the student imitates the teacher and is a checkpoint like any other."""

import json
import queue
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from console.app import main
from console.commands.teaching import Dagger, Practice
from console.run import assembly
from console.run.experiment import Experiment
from console.teaching import dagger
from console.teaching.scenes import TeachingScenes
from learner.config import LearnerConfig
from policy.model.acting import Policy
from tests.support.learning.learners import same
from world.character.features import STATE
from world.config import WorldConfig
from world.errors import InhabitError

SMALL = ["--minutes", "9", "--steps", "30", "--scenes", "16", "--hidden", "64", "32"]


def test_a_student_is_a_checkpoint(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "student"
    words = ["teach", "carry", str(out), *SMALL, "--batches", "600"]
    assert main([*words, "--first", "2000", "--batch", "256"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    found = assembly.trained(out)
    assert found.task == "carry" and found.manifest.layout.hidden == (64, 32)
    assert found.manifest.samples == int(last.split(": ")[1].split(" samples")[0]) >= 2000
    lines = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    assert lines[-1]["batches"] == 600
    assert 2000 <= lines[-1]["samples"] <= found.manifest.samples and 0 < lines[-1]["error"] < 1
    # in scenes that it was not trained in, the error is below 0.6 of the actions' deviation
    scenes = TeachingScenes(Practice(steps=60, scenes=16, seed=77), WorldConfig(task="carry"))
    observations, wanted, _ = scenes.collect(None, 1.0)
    split = observations[:, : STATE.width], observations[:, STATE.width :]
    actions = Policy(found.weights)(*split)
    assert (actions - wanted).square().mean() < 0.6**2 * wanted.var(dim=0).mean()
    # `inhabit evaluate` takes it
    assert main(["evaluate", str(out), "--trials", "4", "--quality", "0", "--threads", "1"]) == 0
    # wider networks that start from it act alike
    wide = tmp_path / "wide"
    words = ["teach", "carry", str(wide), *SMALL[:-2], "--hidden", "96", "48", "--batches", "4"]
    rest = ["--init", str(out), "--first", "1000", "--batch", "64", "--rate", "1e-6"]
    assert main([*words, *rest]) == 0
    wider = assembly.trained(wide)
    assert wider.manifest.layout.hidden == (96, 48)
    other = Policy(wider.weights)(*split)
    assert (other - actions).square().mean() < 0.1 * (actions - wanted).square().mean()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["student", "wide"]


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
