"""Run directories, the metrics file and the display's figures."""

import datetime
import json
import math
from pathlib import Path

import pytest
from rich.console import Console

from console.app import main
from console.run.directory import RunDirectory, RunError, checkpoint_folder, new_run
from console.run.metrics import JsonLines, TensorBoard, read_metrics, truncate_metrics
from console.training.display import Goal, open_display, remaining
from tests.support.paths import ROOT


def test_new_runs_count_up(tmp_path):
    day = datetime.date(2026, 11, 23)
    first = new_run("sit", tmp_path, day)
    assert first.path.name == "sit-2026-11-23-1"
    first.create()
    assert new_run("sit", tmp_path, day).path.name == "sit-2026-11-23-2"


def test_a_run_is_locked_once(tmp_path):
    run = RunDirectory(tmp_path / "r")
    with run.lock(), pytest.raises(RunError, match="in use"), run.lock():
        pass
    with run.lock():
        pass


def test_unwritable_run_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunError, match="cannot make run directory"):
        RunDirectory(tmp_path / "file" / "run").create()


def test_checkpoint_is_found_from_a_run_and_from_itself(tmp_path):
    folder = tmp_path / "run" / "checkpoints" / "000010"
    folder.mkdir(parents=True)
    (folder / "manifest.json").write_text("{}")
    (folder.parent / "latest").symlink_to("000010")
    for where in (tmp_path / "run", folder, folder.parent / "latest"):
        assert checkpoint_folder(where) == folder
    with pytest.raises(RunError, match="does not exist"):
        checkpoint_folder(tmp_path / "none")
    (tmp_path / "empty").mkdir()
    with pytest.raises(RunError, match="no checkpoint"):
        checkpoint_folder(tmp_path / "empty")


def test_metrics_are_cut_where_a_resumed_run_goes_on(tmp_path):
    path = tmp_path / "metrics.jsonl"
    lines = JsonLines(path)
    for iteration in range(1, 6):
        lines.write({"iteration": iteration, "ppo/kl": math.nan})
    lines.close()
    with path.open("a") as file:
        file.write('{"iteration": 6, "ppo')  # killed in the middle of a line
    assert [line["iteration"] for line in read_metrics(path)] == [1, 2, 3, 4, 5]
    assert truncate_metrics(path, 3) == 2
    text = path.read_text().splitlines()
    assert [json.loads(line)["iteration"] for line in text] == [1, 2, 3]
    assert json.loads(text[0])["ppo/kl"] is None


def test_tensorboard_reads_the_same_figures(tmp_path):
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    first = TensorBoard(tmp_path)
    for samples in (100, 200, 300):
        first.write({"iteration": 1, "samples": samples, "ppo/kl": samples / 8, "a/b": math.nan})
    first.close()
    again = TensorBoard(tmp_path, purge_step=201)  # resumed from 200 samples
    again.write({"samples": 300, "ppo/kl": 0.5})
    again.close()
    found = EventAccumulator(str(tmp_path)).Reload()
    assert found.Tags()["scalars"] == ["ppo/kl"]
    kept = [(event.step, event.value) for event in found.Scalars("ppo/kl")]
    assert kept == [(100, 12.5), (200, 25.0), (300, 0.5)]


def test_time_to_go_follows_the_nearest_limit():
    goal = Goal(iterations=100, samples=1000)
    metrics = {"iteration": 10.0, "samples": 500.0, "seconds": 30.0}
    # Half of the samples in 30 s: half a minute to go, though 90 iterations are left.
    assert remaining(goal, metrics, (0.0, 0.0)) == "0:30"
    assert remaining(Goal(), metrics, (0.0, 0.0)) == "-"
    # ten minutes more, of which one is over, in a run that had counted an hour
    timed = Goal(seconds=600.0).after(3600.0)
    since = (timed.fraction(0, 0, 3600.0), 3600.0)
    assert remaining(timed, {"seconds": 3660.0}, since) in ("8:59", "9:00")


@pytest.mark.parametrize("terminal", [True, False])
def test_display_names_every_figure(terminal, tmp_path):
    with (tmp_path / "screen").open("w+") as file:
        console = Console(file=file, force_terminal=terminal, width=200)
        metrics = {
            "iteration": 3.0,
            "samples": 3e6,
            "seconds": 5.0,
            "reward/task": 0.5,
            "reward/style": 0.25,
            "ppo/kl": 0.0123,
            "style/accuracy_mocap": 0.875,
        }
        with open_display("sit", Goal(iterations=9), console) as display:
            display.show(metrics)
        file.seek(0)
        shown = file.read()
    for figure in ("3.0", "0.500", "0.250", "0.0123", "87.5%"):
        assert figure in shown


def test_published_folder_says_what_it_is_and_acts(tmp_path: Path) -> None:
    """The committed policy, published again: nothing of this machine, and the same weights."""
    source = ROOT / "pretrained" / "sit"
    figures = tmp_path / "e.json"
    figures.write_text((source / "evaluation.json").read_text())
    disturbed = tmp_path / "p.json"
    disturbed.write_text(json.dumps(json.loads(figures.read_text()) | {"perturbation": "moved"}))
    out = tmp_path / "mine"
    words = ["publish", str(source), str(out), "--data", "clips", "--licence", "as you like"]
    assert main([*words, "--evaluation", str(figures), str(disturbed)]) == 0
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["notes"]["data"] == "clips"
    assert manifest["notes"]["licence"] == "as you like"
    assert json.loads(manifest["notes"]["experiment"])["world"]["motions"] == []
    assert json.loads(manifest["notes"]["evaluation"])["perturbation"] == "none"
    assert json.loads((out / "evaluation.json").read_text())["checkpoint"] == "mine"
    assert json.loads((out / "evaluation-moved.json").read_text())["perturbation"] == "moved"
    assert (out / "policy.safetensors").read_bytes() == (source / "policy.safetensors").read_bytes()
    assert main([*words]) == 1  # it exists


def test_two_evaluations_of_a_kind_or_none_at_all_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = ROOT / "pretrained" / "sit"
    figures, broken = str(source / "evaluation.json"), tmp_path / "b.json"
    broken.write_text("[]")
    words = ["publish", str(source), str(tmp_path / "mine"), "--data", "clips", "--licence", "any"]
    assert main([*words, "--evaluation", figures, figures]) in (1, 2)
    assert "a second evaluation with perturbation none" in capsys.readouterr().err
    assert main([*words, "--evaluation", str(broken)]) in (1, 2)
    assert "is no evaluation of `inhabit evaluate --json`" in capsys.readouterr().err
    assert not (tmp_path / "mine").exists()


def test_an_average_needs_the_checkpoints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = ROOT / "pretrained" / "sit"
    words = ["publish", str(source), str(tmp_path / "mine"), "--data", "clips", "--licence", "any"]
    assert main([*words, "--average", "2"]) == 1
    assert "--average 2: only 1 up to" in capsys.readouterr().err
    assert main([*words, "--average", "0"]) == 2
    assert "--average 0: must be 1 to 1000" in capsys.readouterr().err
    assert not (tmp_path / "mine").exists()
