"""A training as its user meets it: exit codes, one clear line, and what a run leaves."""

import json
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from console.app import main
from console.run.directory import RunDirectory, RunError, checkpoint_folder
from console.run.metrics import read_metrics
from console.training import command as training
from policy.checkpoints.format import read
from tests.support.console.runs import SMALL, said
from tests.support.paths import ROOT
from tests.support.world.clips import saved
from world.character.features import STATE
from world.errors import ConfigError
from world.motions import clip_file, load
from world.motions.synthetic import library


def test_ctrl_c_leaves_a_checkpoint(tmp_path: Path) -> None:
    run = tmp_path / "run"
    asked = [
        "train", "sit", "--run", str(run), "--scenes", "64", "--block", "32", "--threads", "2",
        "--world.pieces", "4", "--world.scales", "1", "--ppo.hidden", "16", "--style.hidden", "16",
        "--clone-passes", "0", "--style.normaliser-samples", "500",
    ]  # fmt: skip
    process = subprocess.Popen([sys.executable, "-m", "console", *asked], cwd=ROOT)
    waited = time.monotonic() + 110
    while not read_metrics(run / "metrics.jsonl") and time.monotonic() < waited:
        time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 130
    last = read_metrics(run / "metrics.jsonl")[-1]["iteration"]
    assert (run / "checkpoints" / "latest").resolve().name == f"{last:06d}"


def tensors(run: Path, checkpoint: str = "latest") -> dict[str, torch.Tensor]:
    """All tensors of a checkpoint by file and name."""
    folder = run / "checkpoints" / checkpoint
    return {
        f"{file.stem}/{name}": tensor
        for file in sorted(folder.glob("*.safetensors"))
        for name, tensor in load_file(file).items()
    }


def test_a_run_leaves_its_record(run: Path) -> None:
    config = json.loads((run / "config.json").read_text())
    assert config["task"] == "sit" and config["experiment"]["scenes"] == 64
    assert config["machine"]["versions"]["mujoco"]
    lines = read_metrics(run / "metrics.jsonl")
    assert [line["iteration"] for line in lines] == [1, 2, 3, 4]
    assert [line["samples"] for line in lines] == [512, 1024, 1536, 2048]
    wanted = {
        "seconds", "rate/samples_per_s", "rate/world_s", "rate/policy_s", "rate/style_s",
        "rate/update_s", "reward/task", "reward/style", "reward/sit", "style/accuracy_mocap",
        "style/accuracy_policy", "style/loss", "style/penalty", "ppo/kl", "ppo/clip_fraction",
        "ppo/value_explained", "lag/policy", "lag/style", "actors/alive", "dropped/samples",
    }  # fmt: skip
    assert wanted <= set(lines[-1])
    assert list((run / "tensorboard").glob("events*"))


def test_resume_is_exact(run: Path, tmp_path: Path) -> None:
    split = str(tmp_path / "split")
    assert main(["train", "sit", "--run", split, "--iterations", "2", *SMALL]) == 0
    # As after a crash: lines beyond the checkpoint are written again, not twice.
    with (tmp_path / "split" / "metrics.jsonl").open("a") as file:
        file.write('{"iteration": 3, "samples": 1536}\n')
    # As a run begun before this setting existed: it has the default.
    config = json.loads((tmp_path / "split" / "config.json").read_text())
    del config["experiment"]["ppo"]["average"]
    (tmp_path / "split" / "config.json").write_text(json.dumps(config))
    assert main(["train", "sit", "--run", split, "--iterations", "4", "--resume"]) == 0
    whole, resumed = tensors(run), tensors(tmp_path / "split")
    assert whole.keys() == resumed.keys()
    differing = [name for name in whole if not torch.equal(whole[name], resumed[name])]
    assert not differing
    lines = read_metrics(tmp_path / "split" / "metrics.jsonl")
    assert [line["iteration"] for line in lines] == [1, 2, 3, 4]


def test_a_run_is_neither_overwritten_nor_silently_changed(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (run / "config.json").read_bytes(), tensors(run)
    assert main(["train", "sit", "--run", str(run), "--iterations", "5"]) == 1
    assert "--resume or --restart" in said(capsys)
    changed = ["train", "sit", "--run", str(run), "--resume", "--ppo.gamma", "0.9"]
    assert main([*changed, "--iterations", "5"]) == 1
    assert "ppo.gamma: 0.985 -> 0.9" in said(capsys)
    assert (run / "config.json").read_bytes() == before[0]
    assert tensors(run).keys() == before[1].keys()


def test_a_run_goes_on_with_the_teacher_that_it_had_or_not_at_all(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old = tmp_path / "old"
    shutil.copytree(run, old, symlinks=True)
    config = json.loads((old / "config.json").read_text())
    resumed = ["train", "sit", "--run", str(old), "--resume", "--iterations", "4"]
    for teacher, status in ((None, 0), ("carry", 1)):
        config["experiment"]["world"]["teacher"] = teacher
        (old / "config.json").write_text(json.dumps(config))
        assert main(resumed) == status
    line = "was taught by --world.teacher, which no longer exists: start another run with --init"
    assert line in said(capsys)


def test_init_takes_networks_and_refuses_other_shapes(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    start = ["train", "sit", "--init", str(run), "--iterations", "1", *SMALL]
    assert main([*start, "--run", str(tmp_path / "next")]) == 0
    capsys.readouterr()
    other = [*start, "--run", str(tmp_path / "other"), "--ppo.hidden", "16"]
    assert main(other) == 1
    assert "hidden" in said(capsys)


def test_the_preset_finetune_needs_a_policy_to_go_on_from(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["train", "sit", "--preset", "finetune", "--dry-run"]
    assert main(words) == 2
    assert "--preset finetune goes on from a policy" in said(capsys)
    assert main([*words, "--init", "walk"]) == 0
    words = ["train", "lie", "--recipe", "free", "--dry-run"]
    assert main(words) == 2
    assert "--recipe free goes on from a policy" in said(capsys)
    assert main([*words, "--init", "sit-free"]) == 0


def test_init_takes_another_tasks_networks(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Into the same features' columns, by name: sit's target is where carry's box is."""
    start = ["train", "carry", "--init", str(run), "--iterations", "1", *SMALL]
    assert main([*start, "--run", str(tmp_path / "next")]) == 0
    assert "of the task sit" in capsys.readouterr().out
    policy = read(checkpoint_folder(run), ("policy",)).state["policy"]
    theirs, still = policy["actor"], policy["normaliser"]["variance"].sqrt() < 0.01
    # One critic-only iteration: the actor says what it began with, its weights moved against the
    # normaliser, a column at a time.
    found = read(checkpoint_folder(tmp_path / "next"), ("policy",)).state["policy"]["actor"]
    one, other = theirs["layers.0.weight"], found["layers.0.weight"]
    # furniture stands upright on the floor, always: nothing was learned of that
    upright = {STATE.slice("object_position").start + 2, *range(110, 114)}
    upright |= set(torch.nonzero(still[:117]).flatten().tolist())
    unknown = [*sorted(upright), *range(117, other.shape[1])]
    assert torch.nonzero(~other.any(dim=0)).flatten().tolist() == unknown
    kept = [k for k in range(1, 117) if k not in upright]  # the height of the root took over
    scale = other[:, kept] / one[:, kept]
    torch.testing.assert_close(scale, scale[:1].expand_as(scale), rtol=1e-3, atol=0.0)
    assert float(scale.min()) > 0.5 and float(scale.max()) < 2.0, "the state, and where one walks"


def test_clips_that_cannot_be_used(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run"
    assert main(["train", "sit", "--run", str(run), "--motions", str(tmp_path / "none")]) == 2
    assert "none" in said(capsys)
    (tmp_path / "clips").mkdir()
    assert main(["train", "sit", "--run", str(run), "--motions", str(tmp_path / "clips")]) == 1
    assert "no clips found" in said(capsys)
    (tmp_path / "clips" / "broken.npz").write_bytes(b"nothing of the kind")
    assert main(["train", "sit", "--run", str(run), "--motions", str(tmp_path / "clips")]) == 1
    assert "broken.npz" in said(capsys)
    assert not (run / "config.json").exists()


def test_clips_without_what_the_task_uses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Found before a run is made, or an old one erased, and by a dry run too."""
    sits = next(clip for clip in load.own_clips() if clip.seat is not None)
    clip_file.write(tmp_path / "sits.npz", sits)
    walks = saved(tmp_path / "walks.npz", library.walking(np.random.default_rng(0), 1.0))
    run = tmp_path / "run"
    (run / "checkpoints" / "000001").mkdir(parents=True)
    for clips, line in (
        (tmp_path / "sits.npz", "no clip carries a box: --motions must name clips that do"),
        (walks, "no clip carries a box: set --world.initial.reference to 0 or add clips that do"),
    ):
        words = ["train", "carry", "--motions", str(clips), "--run", str(run), "--restart"]
        for more in ([], ["--dry-run"]):
            assert main([*words, *more]) == 1
            assert said(capsys) == f"inhabit: {line}"
            assert (run / "checkpoints" / "000001").exists()
    words = ["train", "carry", "--motions", str(walks), "--dry-run"]
    assert main([*words, "--world.initial.reference", "0"]) == 0


@pytest.mark.parametrize(
    "flags",
    [
        ["--init", "walk", "--ppo.hidden", "64", "64"],
        ["--init", "DAMAGED"],
        ["--init", "carry", "--ppo.skip"],
    ],
)
def test_networks_that_do_not_fit_are_refused_before_a_run_is_erased(
    flags: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    damaged, run = tmp_path / "damaged", tmp_path / "run"
    shutil.copytree(ROOT / "pretrained" / "walk", damaged)
    weights = (damaged / "policy.safetensors").read_bytes()
    (damaged / "policy.safetensors").write_bytes(weights[: len(weights) // 2])
    kept = run / "checkpoints" / "000001" / "kept"
    kept.parent.mkdir(parents=True)
    kept.write_text("x")
    words = ["train", "walk", "--run", str(run), "--restart", "--iterations", "1"]
    named = [str(damaged) if flag == "DAMAGED" else flag for flag in flags]
    assert main([*words, *named]) in (1, 2)
    assert said(capsys).startswith("inhabit: ")
    assert kept.read_text() == "x"


def test_a_failed_start_leaves_what_was_there_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def prepare(run: RunDirectory, *_: object) -> None:
        run.create()
        run.write_config({})

    def learn(*_: object) -> int:
        raise ConfigError("the start fails")

    monkeypatch.setattr(training, "prepare", prepare)
    monkeypatch.setattr(training, "learn", learn)
    deep = tmp_path / "runs" / "mine"
    assert main(["train", "sit", "--run", str(deep)]) == 2
    assert list(tmp_path.iterdir()) == []
    # a folder of the user stays, with its files; so does a run in which something was trained
    deep.mkdir(parents=True)
    (deep / "notes.txt").write_text("mine")
    assert main(["train", "sit", "--run", str(deep)]) == 2
    assert [path.name for path in deep.rglob("*") if path.is_file()] == ["notes.txt"]
    (deep / "metrics.jsonl").write_text("{}\n")
    assert main(["train", "sit", "--run", str(deep)]) == 2
    assert (deep / "config.json").exists() and (deep / "metrics.jsonl").exists()


def test_who_is_refused_a_run_in_use_leaves_its_lock_and_its_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first has the lock and has written nothing else yet."""
    run = RunDirectory(tmp_path / "run")
    with run.lock():
        before = sorted(path.name for path in run.path.iterdir())
        assert main(["train", "sit", "--run", str(run.path)]) == 1
        assert "is in use by another process" in said(capsys)
        assert sorted(path.name for path in run.path.iterdir()) == before == [".lock"]
        with pytest.raises(RunError, match="in use"), run.lock():
            pass


def test_before_the_first_iteration_a_signal_stops_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    left: list[str] = []
    monkeypatch.setattr(training, "leave_soon", lambda: left.append("soon"))
    notes: list[str] = []
    begun = threading.Event()
    with training.interrupts(notes.append, begun, lambda: left.append("abandon")) as stopped:
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert notes == ["stopping at once"] and left == ["soon"] and not stopped()
        begun.set()
        signal.raise_signal(signal.SIGTERM)
        assert stopped() and "the last complete iteration" in notes[1] and left[-1] == "abandon"
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_checkpoints_that_cannot_be_read(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "checkpoint"
    folder.mkdir()
    for file in (run / "checkpoints" / "latest").resolve().iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    whole = (folder / "policy.safetensors").read_bytes()
    (folder / "policy.safetensors").write_bytes(whole[: len(whole) // 2])
    assert main(["evaluate", str(folder), "--trials", "1"]) == 1
    assert "damaged" in said(capsys)
    (folder / "policy.safetensors").write_bytes(whole)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["layout"]["features"][0][1] = 2
    (folder / "manifest.json").write_text(json.dumps(manifest))
    assert main(["evaluate", str(folder), "--trials", "1"]) == 1
    assert "damaged" in said(capsys)
    assert main(["evaluate", str(tmp_path / "none")]) == 2
    assert "none: no such run" in said(capsys)
    assert main(["train", "sit", "--run", str(tmp_path / "no"), "--resume"]) == 1
    assert "no run to resume" in said(capsys)


def test_a_port_in_use(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        assert main(["style", str(run), "--listen", address]) == 1
    assert address in said(capsys)


def test_scenes_that_actors_cannot_share_are_refused_dry(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Before Ray starts, which takes many seconds."""
    words = ["train", "sit", "--dry-run", "--block", "64"]
    for more in (["--runner", "ray"], []):
        assert main([*words, *more, "--actors", "2", "--scenes", "64"]) == 2
        assert "64 scenes cannot be shared by 2 actors in whole blocks of 64" in said(capsys)
    assert main([*words, "--threads", "2", "--scenes", "64"]) == 0
    assert main([*words, "--scenes", "32"]) == 2
    assert "--scenes 32 is not a multiple of --block 64" in capsys.readouterr().err
