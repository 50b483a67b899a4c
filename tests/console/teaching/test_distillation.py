"""`inhabit distill`: the student does what its teachers do, is a checkpoint like any other, and
says what it was learned from; wrong flags are one line."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from console.app import main
from console.commands.teaching import Labelled
from console.run import assembly
from console.run.policy_teachers import PolicyTeacher, Weights
from console.teaching.distillation import LabelledShard
from policy.checkpoints import lineage
from policy.model.acting import Policy
from tests.support.kill_learner import descendants, still_there
from tests.support.paths import ROOT
from world.character.features import STATE
from world.config import InitialStates, WorldConfig

SMALL = ["--minutes", "9", "--steps", "30", "--scenes", "16"]
WORLD = WorldConfig(
    task="sit",
    classes=("chair",),
    pieces=4,
    initial=InitialStates(0, 0, 1, far_m=(2, 4), standing_fraction=0.5),
    episode_s=20.0,
)


@pytest.fixture(scope="module")
def walker() -> PolicyTeacher:
    walk = assembly.trained(Path("walk"))
    return PolicyTeacher({"walker": Weights(walk.experiment.world, walk.weights)})


def test_a_student_is_a_checkpoint(
    walker: PolicyTeacher, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "student"
    words = ["distill", "sit", str(out), *SMALL, "--batches", "150", "--first", "3000"]
    world = ["--world.walker", "walk", "--world.classes", "chair", "--world.pieces", "4"]
    rest = ["--batch", "256", "--init", "walk", "--rate", "3e-4"]
    assert main([*words, *world, *rest]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    found = assembly.trained(out)
    assert found.task == "sit"
    assert found.manifest.samples == int(last.split(": ")[1].split(" samples")[0]) >= 3000
    lines = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    assert lines[-1]["batches"] == 150 and 0 < lines[-1]["error"] < 0.5
    # in scenes that it was not trained in, the error is below 0.6 of the actions' deviation
    scenes = LabelledShard(Labelled(steps=60, scenes=16, seed=77), WORLD, walker)
    seen, wanted, _ = scenes.collect(None, 1.0)
    actions = Policy(found.weights)(seen[:, : STATE.width], seen[:, STATE.width :])
    assert (actions - wanted).square().mean() < 0.6**2 * wanted.var(dim=0).mean()
    # who walks was trained on mocap, and so was who learned from it
    named = " ".join(origin.licence for origin in lineage.of(found.manifest.notes))
    assert "Carnegie" in named or "CMU" in named
    # a student may not name its teachers: they are not there for whom it is given to
    assert found.experiment.world.walker == found.experiment.world.tracker == ""
    assert main(["evaluate", str(out), "--trials", "4", "--quality", "0", "--threads", "1"]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["student"]


@pytest.mark.parametrize(
    ("task", "teachers"),
    [
        ("lie", ["--world.walker", "walk", "--world.pieces", "4"]),
        (
            "carry",
            [
                *("--world.walker", "walk", "--world.tracker", "track"),
                *("--world.carry.sizes", "2", "--world.carry.scale", "0.8", "0.8"),
                *("--world.carry.stand-m", "0.5", "0.5"),
            ],
        ),
    ],
)
def test_other_tasks_from_nothing(task: str, teachers: list[str], tmp_path: Path) -> None:
    out = tmp_path / task
    words = ["distill", task, str(out), *SMALL, "--batches", "60", "--first", "1000"]
    assert main([*words, "--batch", "128", "--hidden", "64", "32", *teachers]) == 0
    found = assembly.trained(out)
    assert found.task == task and found.manifest.layout.hidden == (64, 32)
    lines = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    # the first guess is the mean of the labels: what is learned is less than their deviation
    assert lines[-1]["samples"] >= 1000 and 0 < lines[-1]["error"] < 0.5


def test_the_teacher_labels_what_it_would_do(walker: PolicyTeacher) -> None:
    """While the teacher alone drives, without noise, its label is the action that is taken, and
    states before a fall and without a label are left out."""
    one = LabelledShard(Labelled(steps=60, scenes=8, noise=0.0, seed=3), WORLD, walker)
    other = assembly.shard(
        WORLD, range(8), 3, teacher=walker.teacher(
            WORLD, assembly.library_of(WORLD), assembly.training_bank(WORLD), 8
        ),
    )  # fmt: skip
    seen, labels, ended = one.collect(None, 1.0)
    assert seen.shape[1] == STATE.width + one.shard.task.goal.width
    assert ended.shape[1] == 3 + len(one.shard.task.stages)
    expected = []
    for _ in range(60):
        state, goal = other.observe()
        label = other.label()
        assert label is not None
        again = other.label()
        assert again is label  # asked twice in a control step, it answers the same
        expected.append((torch.cat((state, goal), dim=1), label.clone()))
        step = other.step(label.nan_to_num())
        assert step.teacher_action is label
    # the last 25 steps wait for whether a fall follows
    wanted = torch.cat([state for state, _ in expected[:35]])
    known = ~torch.cat([label for _, label in expected[:35]]).isnan().any(dim=1)
    assert len(seen) <= int(known.sum())
    torch.testing.assert_close(seen[:40], wanted[known][:40])
    torch.testing.assert_close(
        labels[:40], torch.cat([x for _, x in expected])[: len(known)][known][:40]
    )


def test_a_student_that_drives_alone(walker: PolicyTeacher) -> None:
    """With a spell without end the student's actions are taken; the teacher labels them."""
    one = LabelledShard(Labelled(steps=40, scenes=8, noise=0.0, seed=3), WORLD, walker)
    one._drives[:] = True
    one.shard._steps[:] = 0  # no episode times out, after which the teacher would drive
    still = assembly.learner(assembly.trained(Path("sit")).experiment)
    student = Policy(still.averaged_weights())
    still.close()
    taken = []
    act = one.shard.step
    one.shard.step = lambda action: (taken.append(action.clone()), act(action))[1]  # type: ignore[method-assign]
    states = []
    watch = one.shard.observe
    one.shard.observe = lambda: (states.append([x.clone() for x in watch()]), watch())[1]  # type: ignore[method-assign]
    _, labels, _ = one.collect(student, 1e9)
    for (state, goal), action in zip(states[1:21], taken[:20], strict=True):
        torch.testing.assert_close(action, student(state, goal))
    assert len(labels) and bool(labels.isfinite().all())


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("sit OUT", "nothing here teaches: name a policy that walks (--world.walker)"),
        ("swim OUT --world.walker walk", "swim: no task that is distilled: choose one of sit, lie"),
        ("walk OUT", "walk: no task that is distilled: choose one of sit, lie, carry"),
        ("track OUT --world.walker walk", "track: no task that is distilled: choose one of sit"),
        ("lie OUT --world.tracker track", "no scene here has the task sit or carry: leave it out"),
        ("sit OUT --world.walker sit", "is a policy of the task sit: name a run or checkpoint of"),
        ("sit OUT --world.walker none", "none"),
        ("sit OUT --world.walker walk --init none", "none"),
        ("sit OUT --workers 0", "--workers 0: must be 1 to 1024"),
        ("sit OUT --minutes nan", "--minutes nan: must be 0.001 to 1000000"),
        ("sit OUT --batches 0", "--batches 0: must be 1 to 1000000000"),
        ("sit OUT --spell 0 10", "--spell 0: must be 0.001 to 1000000"),
        ("sit OUT --noise -1", "--noise -1: must be 0 to 10"),
        ("sit TMP --world.walker walk", "is not a checkpoint: choose another folder"),
    ],
)
def test_bad_flags(
    words: str, line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    places = {"OUT": str(tmp_path / "out"), "TMP": str(tmp_path)}
    assert main(["distill", *(places.get(word, word) for word in words.split())]) == 2
    text = capsys.readouterr().err.strip().splitlines()
    assert text[-1].startswith("inhabit: ") and line in text[-1]
    assert not (tmp_path / "out").exists()


def test_an_existing_checkpoint_is_replaced_on_request_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    shutil.copytree(ROOT / "pretrained" / "walk", out)
    (out / "mine.txt").write_text("x")
    words = ["distill", "sit", str(out), "--world.walker", "walk"]
    for more, why in (([], "add --replace"), (["--replace"], "holds mine.txt")):
        assert main([*words, *more]) in (1, 2)
        assert why in capsys.readouterr().err
        assert (out / "mine.txt").exists() and (out / "policy.safetensors").exists()


def test_no_worker_outlives_a_distillation_that_is_killed(tmp_path: Path) -> None:
    """Nobody takes their labels any more: the queue is full, and they end."""
    small = ["--steps", "30", "--scenes", "16", "--first", "9000", "--workers", "2"]
    world = ["--world.walker", "walk", "--world.classes", "chair", "--world.pieces", "2"]
    process = subprocess.Popen(
        [sys.executable, "-m", "console", "distill", "sit", str(tmp_path / "out"), *small, *world],
        cwd=ROOT, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    for line in process.stdout:
        if line.endswith("of 9000 samples\n"):  # they label
            break
    family = descendants(process.pid)
    process.kill()
    process.wait(60)
    assert len(family) >= 2 and still_there(family, within_s=60) == 0
