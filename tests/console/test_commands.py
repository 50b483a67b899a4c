"""The command line as its user meets it: exit codes, one clear line, and what a run leaves."""

import json
import socket
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from console.app import main
from console.run.directory import checkpoint_folder
from console.run.metrics import read_metrics
from policy.checkpoints.format import read

SMALL = [
    "--scenes", "64", "--block", "32", "--world.pieces", "4", "--world.scales", "1",
    "--ppo.hidden", "32", "--style.hidden", "32", "--style.batch", "64", "--clone-passes", "1",
    "--clone-samples", "256", "--threads", "2", "--ppo.warmup-iterations", "1",
    "--style.normaliser-samples", "500", "--style.replay", "2000",
]  # fmt: skip


def said(capsys: pytest.CaptureFixture[str]) -> str:
    """The one line that an error is."""
    text = capsys.readouterr().err.strip()
    assert text.startswith("inhabit: ") and "\n" not in text and "Traceback" not in text, text
    return text


def tensors(run: Path, checkpoint: str = "latest") -> dict[str, torch.Tensor]:
    """All tensors of a checkpoint by file and name."""
    folder = run / "checkpoints" / checkpoint
    return {
        f"{file.stem}/{name}": tensor
        for file in sorted(folder.glob("*.safetensors"))
        for name, tensor in load_file(file).items()
    }


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of four iterations."""
    folder = tmp_path_factory.mktemp("runs") / "whole"
    assert main(["train", "sit", "--run", str(folder), "--iterations", "4", *SMALL]) == 0
    return folder


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


def test_init_takes_networks_and_refuses_other_shapes(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    start = ["train", "sit", "--init", str(run), "--iterations", "1", *SMALL]
    assert main([*start, "--run", str(tmp_path / "next")]) == 0
    capsys.readouterr()
    other = [*start, "--run", str(tmp_path / "other"), "--ppo.hidden", "16"]
    assert main(other) == 1
    assert "hidden" in said(capsys)


def test_init_takes_another_tasks_networks(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Into the same features' columns, by name: sit's target is where carry's box is."""
    start = ["train", "carry", "--init", str(run), "--iterations", "1", *SMALL]
    assert main([*start, "--run", str(tmp_path / "next")]) == 0
    assert "of the task sit" in capsys.readouterr().out
    theirs = read(checkpoint_folder(run), ("policy",)).state["policy"]["actor"]
    # One critic-only iteration: the actor says what it began with, its weights moved against the
    # normaliser, a column at a time.
    found = read(checkpoint_folder(tmp_path / "next"), ("policy",)).state["policy"]["actor"]
    one, other = theirs["layers.0.weight"], found["layers.0.weight"]
    scale = other[:, :117] / one[:, :117]
    torch.testing.assert_close(scale, scale[:1].expand_as(scale), rtol=1e-3, atol=0.0)
    assert float(scale.min()) > 0.5 and float(scale.max()) < 2.0, "the state, and where one walks"
    assert not other[:, 117:].any()


def test_bad_arguments_are_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["train", "fly"]) == 2
    assert "choose one of carry, lie, sit" in said(capsys)
    assert main(["train", "sit", "--resume", "--restart", "--run", str(tmp_path)]) == 2
    assert "contradict" in said(capsys)
    assert main(["train", "sit", "--scenes", "100"]) == 2
    assert "multiple" in said(capsys)
    assert main(["train", "sit", "--address", "127.0.0.1:1"]) == 2
    assert "--runner ray" in said(capsys)
    assert main(["train", "sit", "--resume"]) == 2
    assert "--run" in said(capsys)
    assert main(["train"]) == 2
    assert main(["frobnicate"]) == 2
    assert main(["video", str(tmp_path)]) == 2


def test_clips_that_cannot_be_used(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run"
    assert main(["train", "sit", "--run", str(run), "--motions", str(tmp_path / "none")]) == 1
    assert "no such file" in said(capsys)
    (tmp_path / "clips").mkdir()
    assert main(["train", "sit", "--run", str(run), "--motions", str(tmp_path / "clips")]) == 1
    assert "no clips found" in said(capsys)
    (tmp_path / "clips" / "broken.npz").write_bytes(b"nothing of the kind")
    assert main(["train", "sit", "--run", str(run), "--motions", str(tmp_path / "clips")]) == 1
    assert "broken.npz" in said(capsys)
    assert not (run / "config.json").exists()


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
    assert main(["evaluate", str(tmp_path / "none")]) == 1
    assert "does not exist" in said(capsys)
    assert main(["train", "sit", "--run", str(tmp_path / "no"), "--resume"]) == 1
    assert "no run to resume" in said(capsys)


def test_a_port_in_use(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        assert main(["style", str(run), "--listen", address]) == 1
    assert address in said(capsys)


def test_dry_run_shows_everything_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    assert main(["train", "sit", "--dry-run", "--preset", "paper", "--run", str(run)]) == 0
    shown = capsys.readouterr().out
    for text in ("state: 114 numbers", "goal", "29 numbers", "overspeed", '"gamma": 0.99', "1024"):
        assert text in shown
    assert not run.exists()


def test_evaluate_does_not_depend_on_threads(run: Path, tmp_path: Path) -> None:
    figures = []
    for threads in ("1", "2"):
        out = tmp_path / f"{threads}.json"
        asked = ["evaluate", str(run), "--trials", "140", "--threads", threads, "--json", str(out)]
        assert main([*asked, "--quality", "8"]) == 0
        figures.append(json.loads(out.read_text()))
        figures[-1].pop("wall_s")
    assert figures[0] == figures[1]
    assert {"success", "sustained", "falls", "by_object", "by_distance"} <= set(figures[0])
    assert {"by_stage", "quality", "preset"} <= set(figures[0])
    assert figures[0]["quality"]["policy"]["style_reward"] > 0
    assert figures[0]["quality"]["mocap"]["nearest_mocap"]["median"] > 0
    assert list((run / "evaluations").glob("*.json"))


def test_lists_and_checks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["objects", "list", "--json"]) == 0
    pieces = json.loads(capsys.readouterr().out)
    assert len(pieces) == 410 and {"piece", "category", "size_m", "sit"} <= set(pieces[0])
    (tmp_path / "broken.npz").write_bytes(b"nothing of the kind")
    assert main(["motions", "check", str(tmp_path), "--json"]) == 1
    report = json.loads(capsys.readouterr().out)[0]
    assert report["clip"] == "broken" and "not a readable" in report["refused"]
