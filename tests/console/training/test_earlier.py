"""A recipe with runs before its own: what they are given, what is left of them, how they go on."""

import json
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from console.app import main, parse
from console.commands import Train
from console.run.directory import RunDirectory, RunError
from console.run.metrics import read_metrics
from console.run.stages import Before
from console.training import earlier
from console.training.command import resolve
from policy.checkpoints import lineage
from policy.checkpoints.format import read_manifest
from tests.support.console.recipes import with_runs_before
from tests.support.console.runs import said
from tests.support.kill_learner import flags
from tests.support.paths import ROOT
from tests.support.small_clips import write

#: Iterations of a tracker that is interrupted.
LONG = 4000


def words(folder: Path, followed: int) -> list[str]:
    """A training by the recipe, without its run."""
    rest = flags(write(folder / "clips"))
    at = rest.index("--preset")
    del rest[at : at + 2]  # the recipe has its own
    return ["train", "sit", "--recipe", str(with_runs_before(folder, followed)), *rest]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the recipe to its end."""
    folder = tmp_path_factory.mktemp("whole")
    assert main([*words(folder, 4), "--seed", "3", "--run", str(folder / "run")]) == 0
    return folder / "run"


def test_each_run_has_what_the_recipe_and_the_command_say(whole: Path) -> None:
    before = whole / "before"
    assert json.loads((before / "complete.json").read_text()) == ["way", "clips", "both"]
    found = {}
    for name, task in (("way", "walk"), ("clips", "track")):
        config = json.loads((before / name / "config.json").read_text())
        found[name] = config["experiment"]
        assert config["task"] == task
        assert found[name]["seed"] == 3 and found[name]["ppo"]["hidden"] == [32, 16]
        assert [line["iteration"] for line in read_metrics(before / name / "metrics.jsonl")] == [
            1, 2, 3, 4,
        ]  # fmt: skip
    given = [str(whole.parent / "clips")]
    assert found["way"]["world"]["motions"] == found["clips"]["world"]["motions"] == given
    assert len(json.loads((whole / "config.json").read_text())["experiment"]["before"]) == 3


def test_the_run_begins_from_the_last_of_them(whole: Path, tmp_path: Path) -> None:
    """The critic alone learns in the first iteration, so the actor is still the distilled one. Its
    first layer changes with the normaliser."""
    lines = read_metrics(whole / "metrics.jsonl")
    assert [line["iteration"] for line in lines] == list(range(1, 11))
    run = tmp_path / "run"
    shutil.copytree(whole, run, symlinks=True)
    shutil.rmtree(run / "checkpoints")
    assert main(["train", "sit", "--resume", "--run", str(run), "--iterations", "1"]) == 0
    distilled, begun = (
        load_file(folder / "policy.safetensors")
        for folder in (run / "before" / "both", run / "checkpoints" / "latest")
    )
    actor = [name for name in distilled if name.startswith(("actor/layers.2", "actor/layers.4"))]
    assert len(actor) == 4 and all(torch.equal(begun[name], distilled[name]) for name in actor)
    both = read_manifest(whole / "before" / "both")
    assert both.layout.task == "sit" and both.samples >= 200
    notes = read_manifest(whole / "checkpoints" / "latest").notes
    assert set(lineage.of(both.notes)) <= set(lineage.of(notes)), "what it was learned from"


def test_resuming_a_complete_run_makes_none_again(whole: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    shutil.copytree(whole, run, symlinks=True)
    kept = _files(run / "before")
    assert main(["train", "sit", "--resume", "--run", str(run), "--iterations", "12"]) == 0
    assert _files(run / "before") == kept
    assert main(["train", "sit", "--restart", "--run", str(run), "--iterations", "1",
                 "--scenes", "8", "--block", "8", "--world.pieces", "2", "--world.scales", "1",
                 "--clone-passes", "0"]) == 0  # fmt: skip
    assert not (run / "before").exists()


def _files(folder: Path) -> dict[str, int]:
    return {str(f): f.stat().st_mtime_ns for f in folder.rglob("*") if f.is_file()}


def test_what_is_made_before_outlives_a_run_that_left_no_checkpoint(
    whole: Path, tmp_path: Path
) -> None:
    """As after a SIGKILL in its first iterations, whose metrics are there."""
    run = tmp_path / "run"
    shutil.copytree(whole, run, symlinks=True)
    shutil.rmtree(run / "checkpoints")
    kept = _files(run / "before")
    assert main(["train", "sit", "--resume", "--run", str(run)]) == 0
    assert _files(run / "before") == kept
    lines = read_metrics(run / "metrics.jsonl")
    assert [line["iteration"] for line in lines] == list(range(1, 11))


def test_ctrl_c_between_the_runs_loses_nothing(tmp_path: Path) -> None:
    """In the second of them; `--resume` goes on with it and leaves the first alone."""
    run = tmp_path / "run"
    process = subprocess.Popen(
        [sys.executable, "-m", "console", *words(tmp_path, LONG), "--run", str(run)], cwd=ROOT
    )
    until = time.monotonic() + 110
    while len(read_metrics(run / "before/clips/metrics.jsonl")) < 3:
        assert process.poll() is None and time.monotonic() < until
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 130
    assert json.loads((run / "before/complete.json").read_text()) == ["way"]
    followed = len(read_metrics(run / "before/clips/metrics.jsonl"))
    walked = _files(run / "before/way")
    config = (run / "config.json").read_text()  # the test need not wait for LONG iterations
    (run / "config.json").write_text(config.replace(f" {LONG} ", f" {followed + 2} "))
    assert main(["train", "sit", "--resume", "--run", str(run)]) == 0
    assert _files(run / "before/way") == walked
    lines = read_metrics(run / "before/clips/metrics.jsonl")
    assert [line["iteration"] for line in lines] == list(range(1, followed + 3))
    assert json.loads((run / "before/complete.json").read_text()) == ["way", "clips", "both"]


class Clock:
    """A clock that each command moves on."""

    def __init__(self) -> None:
        self.minutes = 0.0

    def monotonic(self) -> float:
        return 60.0 * self.minutes


def made(
    tmp_path: Path, more: Sequence[str], inhabit: earlier.Inhabit
) -> tuple[int | None, Train, RunDirectory]:
    command = parse([*words(tmp_path, 4), *more])
    run = RunDirectory(tmp_path / "run")
    return *earlier.train(run, command, command.experiment, inhabit, lambda line: None), run


def test_minutes_are_of_all_runs_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock, given = Clock(), []
    monkeypatch.setattr(earlier, "time", clock)

    def inhabit(asked: Sequence[str]) -> int:
        given.append(float(asked[asked.index("--minutes") + 1]))
        clock.minutes += 6.0
        return 0

    code, _, run = made(tmp_path, ["--minutes", "10"], inhabit)
    assert code == 0 and given == [10.0, pytest.approx(4.0)]
    complete = json.loads((run.before / "complete.json").read_text())
    assert complete == ["way"], "the second was stopped by the time"
    monkeypatch.setattr(earlier, "time", clock := Clock())
    (run.before / "complete.json").write_text(json.dumps(["way", "clips"]))
    assert (
        made(tmp_path, ["--minutes", "10"], lambda _: setattr(clock, "minutes", 10.0) or 0)[0] == 0
    )
    complete = json.loads((run.before / "complete.json").read_text())
    assert complete == ["way", "clips", "both"], "no time stops a distillation"


def test_time_that_is_left_is_the_run_s_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = Clock()
    monkeypatch.setattr(earlier, "time", clock)

    def inhabit(asked: Sequence[str]) -> int:
        clock.minutes += 2.0
        return 0

    code, command, run = made(tmp_path, ["--minutes", "10"], inhabit)
    assert code is None and command.minutes == pytest.approx(4.0)
    assert command.init == run.before / "both" and not command.resume


def test_a_run_may_have_the_package_s_clips_and_its_own_flags_win(tmp_path: Path) -> None:
    command = parse([*words(tmp_path, 4), "--device", "cpu", "--actors", "2", "--debug"])
    experiment = resolve(command)
    one, other, taught = experiment.before
    run = RunDirectory(tmp_path / "run")

    def asked(before: Before) -> list[str]:
        return earlier.words(before, run, command, experiment, 3.0)

    found = asked(one)
    assert found[:4] == ["train", "walk", "--run", str(run.before / "way")]
    for flag, value in (("--device", "cpu"), ("--actors", "2"), ("--minutes", "3.0")):
        assert found[found.index(flag) + 1] == value
    assert "--debug" in found and "--motions" in found and "--resume" not in found
    assert "--motions" not in asked(replace(one, clips="own"))
    own = asked(replace(other, command=f"{other.command} --seed 9 --ppo.hidden=8"))
    assert own.count("--seed") == 1 and "--ppo.hidden" not in own
    found = asked(taught)
    assert found[:3] == ["distill", "sit", str(run.before / "both")] and "--actors" not in found
    assert found[found.index("--init") + 1] == str(run.before / "way")
    assert found[found.index("--hidden") + 1 :][:2] == ["32", "16"]
    (run.before / "way").mkdir(parents=True)
    (run.before / "both").mkdir()
    (run.before / "way" / "config.json").touch()
    assert "--restart" in asked(one) and "--replace" in asked(taught), "killed at its beginning"
    (run.before / "way" / "checkpoints" / "000002").mkdir(parents=True)
    assert "--resume" in asked(one) and "--restart" not in asked(one)


def test_a_run_that_fails_ends_the_command_and_is_tried_again(tmp_path: Path) -> None:
    tried = []

    def inhabit(asked: Sequence[str]) -> int:
        tried.append(asked[1])
        return 1 if len(tried) == 2 else 0

    with pytest.raises(RunError, match=r"before/clips ended with exit code 1; --resume --run"):
        made(tmp_path, [], inhabit)
    code, _, _ = made(tmp_path, [], inhabit)
    assert code is None and tried == ["walk", "track", "track", "sit"]


def test_with_init_the_runs_before_are_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [*words(tmp_path, 4), "--init", "sit-free", "--ppo.hidden", "512", "256", "--dry-run"]
    assert main(given) == 0
    shown = capsys.readouterr()
    assert "--init sit-free: what the recipe trains before this run is left out" in shown.err
    assert "made before" not in shown.out
    assert main([*words(tmp_path, 4), "--dry-run"]) == 0
    shown = capsys.readouterr().out
    assert "made before, in RUN/before" in shown and "distill sit --init {way}" in shown


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("train walk", "train wlak", "before way: command: unknown task"),
        ("--iterations 4", "--iteration 4", "before way: command: "),
        ("distill sit --init", "distill sit --inti", "before both: command: "),
        ("--batches 20", "--batches none", "before both: command: "),
        ("train track", "train sit --recipe paper", "the recipe paper has runs before its own"),
    ],
)  # fmt: skip
def test_a_wrong_command_is_refused_hours_before_it_is_reached(
    old: str, new: str, line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = words(tmp_path, 4)
    path = Path(given[given.index("--recipe") + 1])
    path.write_text(path.read_text().replace(old, new))
    assert main([*given, "--run", str(tmp_path / "run")]) == 2
    assert line in said(capsys) and not (tmp_path / "run").exists()
