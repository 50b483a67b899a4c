"""Checkpoints whose bits flip or whose end is missing: never loaded, and an older one is."""

import json
import random
import shutil
from pathlib import Path

import pytest

from console.app import main
from console.run.metrics import read_metrics
from policy.checkpoints.format import read, write
from policy.errors import CheckpointError, LayoutError
from tests.support import small_clips
from tests.support.kill_learner import Outcome, compare, flags
from tests.support.learning.checkpoints import LAYOUT, MANIFEST, assert_same, state

FLIPS, CUTS = 300, 60


@pytest.fixture
def checkpoint(tmp_path: Path) -> Path:
    return write(tmp_path / "000012", state(), MANIFEST)


def files(checkpoint: Path) -> list[Path]:
    found = sorted(checkpoint.iterdir())
    assert len(found) == 4
    return found


def refused(checkpoint: Path) -> None:
    with pytest.raises((CheckpointError, LayoutError)) as caught:
        read(checkpoint, layout=LAYOUT)
    assert "\n" not in str(caught.value) and "000012" in str(caught.value)


def test_any_flipped_bit_is_found(checkpoint: Path) -> None:
    draw = random.Random(0)
    for file in files(checkpoint):
        whole = file.read_bytes()
        for _ in range(FLIPS):
            bits = bytearray(whole)
            at = draw.randrange(8 * len(bits))
            bits[at // 8] ^= 1 << at % 8
            file.write_bytes(bits)
            refused(checkpoint)
        file.write_bytes(whole)
    assert_same(read(checkpoint, layout=LAYOUT).state, state())


def test_any_missing_end_is_found(checkpoint: Path) -> None:
    draw = random.Random(1)
    for file in files(checkpoint):
        whole = file.read_bytes()
        for length in [0, len(whole) - 1, *(draw.randrange(len(whole)) for _ in range(CUTS))]:
            file.write_bytes(whole[:length])
            refused(checkpoint)
        file.write_bytes(whole)
    assert_same(read(checkpoint, layout=LAYOUT).state, state())


def test_a_manifest_of_the_first_format_is_still_read(checkpoint: Path) -> None:
    """It had no digest of its own."""
    file = checkpoint / "manifest.json"
    table = json.loads(file.read_text())
    del table["sha256"]
    file.write_text(json.dumps(table | {"format": 1}))
    assert_same(read(checkpoint, layout=LAYOUT).state, state())
    file.write_text(json.dumps(table))
    refused(checkpoint)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """`whole` went to iteration 9 undisturbed, `begun` to 6; both keep every third."""
    folder = tmp_path_factory.mktemp("runs")
    asked = flags(small_clips.write(folder / "clips"))
    for name, iterations in (("whole", "9"), ("begun", "6")):
        words = ["train", "sit", "--run", str(folder / name), "--iterations", iterations]
        assert main([*words, *asked]) == 0
    return folder, asked


@pytest.mark.parametrize("damage", ["flipped", "cut", "missing", "gone"])
def test_resume_goes_on_from_the_one_before_to_the_same_bits(
    damage: str, runs: tuple[Path, list[str]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, asked = runs
    run = tmp_path / "run"
    shutil.copytree(folder / "begun", run, symlinks=True)
    latest = run / "checkpoints" / "000006"
    file = latest / "training.safetensors"
    match damage:
        case "flipped":
            bits = bytearray(file.read_bytes())
            bits[len(bits) // 2] ^= 16
            file.write_bytes(bits)
        case "cut":
            file.write_bytes(file.read_bytes()[:-7])
        case "missing":
            (latest / "manifest.json").unlink()
        case "gone":
            shutil.rmtree(latest)
    capsys.readouterr()
    again = ["train", "sit", "--run", str(run), "--resume", "--iterations", "9", *asked]
    assert main(again) == 0
    said = capsys.readouterr().out
    assert "resumed from" in said and "000003" in said
    if damage != "gone":
        assert said.count("000006") == 1, "and why"
    compare(folder / "whole", run, Outcome())


def test_no_whole_checkpoint_is_one_clear_line(
    runs: tuple[Path, list[str]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, asked = runs
    run = tmp_path / "run"
    shutil.copytree(folder / "begun", run, symlinks=True)
    for file in run.glob("checkpoints/0*/policy.safetensors"):
        file.write_bytes(b"")
    capsys.readouterr()
    again = ["train", "sit", "--run", str(run), "--resume", "--iterations", "9", *asked]
    assert main(again) == 1
    errors = [line for line in capsys.readouterr().err.splitlines() if "inhabit: " in line]
    assert len(errors) == 1 and "000006/policy.safetensors is damaged" in errors[0]
    assert len(read_metrics(run / "metrics.jsonl")) == 6, "nothing was changed"
