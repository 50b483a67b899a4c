"""Runs and caches that were damaged, edited or deleted: what is whole stays, the rest is said."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from console.app import main
from console.run.metrics import read_metrics
from tests.support import small_clips
from tests.support.paths import ROOT
from world.motions import cache
from world.motions.clip import Clip
from world.motions.synthetic import library

SMALL = [
    "--scenes", "16", "--block", "16", "--horizon", "4", "--world.pieces", "2",
    "--world.scales", "1", "--ppo.hidden", "32", "16", "--style.hidden", "32", "16",
    "--style.batch", "32", "--style.penalty-batch", "16", "--style.normaliser-samples", "500",
    "--style.replay", "1000", "--clone-passes", "0", "--threads", "1",
]  # fmt: skip


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A run of two iterations."""
    clips = small_clips.write(tmp_path / "clips")
    path = tmp_path / "run"
    words = ["train", "sit", "--run", str(path), "--iterations", "2", "--motions", str(clips)]
    assert main([*words, *SMALL]) == 0
    return path


def resume(run: Path, iterations: int) -> int:
    return main(["train", "sit", "--run", str(run), "--resume", "--iterations", str(iterations)])


@pytest.mark.parametrize(
    "damage",
    [b'{"iteration": 1, "sam\n', b"\xff\xfe\x00\n", b"[]\n", b'{"iteration": "x"}\n', b"7\n"],
)
def test_a_damaged_line_of_metrics_deletes_no_other(run: Path, damage: bytes) -> None:
    metrics = run / "metrics.jsonl"
    first, second = metrics.read_bytes().splitlines(keepends=True)
    metrics.write_bytes(first + damage + second)
    assert [line["iteration"] for line in read_metrics(metrics)] == [1, 2]
    assert resume(run, 3) == 0
    lines = metrics.read_bytes().splitlines(keepends=True)
    assert lines[:2] == [first, second], "not a byte of the others is changed"
    assert [line["iteration"] for line in read_metrics(metrics)] == [1, 2, 3]


def test_an_edited_configuration_is_refused_with_the_difference(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = json.loads((run / "config.json").read_text())
    config["experiment"]["ppo"]["gamma"] = 0.5
    (run / "config.json").write_text(json.dumps(config))
    before = (run / "metrics.jsonl").read_bytes()
    assert resume(run, 3) == 1
    said = capsys.readouterr().err
    assert "config.json was changed since the checkpoint was written: ppo.gamma: " in said
    assert "-> 0.5" in said and said.count("\n") == 1
    assert (run / "metrics.jsonl").read_bytes() == before


def test_a_damaged_clip_cache_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import numpy as np

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    clip = library.walking(np.random.default_rng(0), 1.0).part(0, 40)
    made: list[int] = []

    def make() -> list[Clip]:
        made.append(1)
        return [clip]

    (path,) = (cache.cached("k", make), *tmp_path.rglob("*.npz"))[1:]
    whole = path.read_bytes()
    for damaged in (
        b"",
        whole[:500],
        whole[:-40],
        b"PK" + whole[2:900],
        whole.replace(b"fps", b"f"),
    ):
        path.write_bytes(damaged)
        before = len(made)
        (found,) = cache.cached("k", make)
        assert len(made) == before + 1 and found.frames == 40
        assert path.read_bytes() == whole, "and kept again"
    cache.cached("k", make)
    assert len(made) == 6, "the whole one is read"


def test_a_run_deleted_under_a_training_ends_it(run: Path, tmp_path: Path) -> None:
    """A real training, whose folder goes: exit 1, one line, and nothing comes to life again."""
    going = tmp_path / "going"
    words = ["train", "sit", "--run", str(going), "--motions", str(tmp_path / "clips"), *SMALL]
    process = subprocess.Popen(
        [sys.executable, "-m", "console", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, cwd=ROOT, env=dict(os.environ, PYTHONPATH=str(ROOT)),
    )  # fmt: skip
    try:
        deadline = time.monotonic() + 120
        while len(read_metrics(going / "metrics.jsonl")) < 2 and time.monotonic() < deadline:
            assert process.poll() is None
            time.sleep(0.05)
        shutil.rmtree(going)
        _, said = process.communicate(timeout=120)
        assert process.returncode == 1
        assert "metrics.jsonl was deleted during the run" in said.splitlines()[-1]
        assert not (going / "checkpoints").exists()
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
            process.wait()
