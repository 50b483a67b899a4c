"""`inhabit train --objects`: training on imported pieces, and what is refused."""

import json
from pathlib import Path

import pytest

from console.app import main
from console.run import assembly
from tests.support.world.meshes import kept
from world.config import WorldConfig
from world.furniture.catalogue import find

SMALL = [
    "--scenes", "32", "--block", "32", "--horizon", "4", "--world.scales", "1", "--threads", "1",
    "--ppo.hidden", "16", "--ppo.minibatch", "64", "--ppo.epochs", "1", "--style.hidden", "16",
    "--clone-passes", "0",
]  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A chair, a stool and a table, imported."""
    for name in ("chair-train-003", "low-stool-train-001", "table-train-000"):
        kept(tmp_path / "own", find(name))
    return tmp_path / "own"


def test_a_run_trains_on_imported_pieces(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    words = ["train", "sit", "--run", str(run), "--objects", str(folder), "--iterations", "1"]
    assert main([*words, *SMALL]) == 0
    assert "1 of 3 pieces have no place to sit: table-train-000" in capsys.readouterr().out
    world = json.loads((run / "config.json").read_text())["experiment"]["world"]
    assert world["objects"] == [str(folder)]
    (line,) = (run / "metrics.jsonl").read_text().splitlines()
    assert json.loads(line)["samples"] == 32 * 4
    # other furniture is another experiment
    again = ["train", "sit", "--run", str(run), "--resume", "--objects", "train", *SMALL]
    assert main(again) == 1
    assert "world.objects" in capsys.readouterr().err


def test_the_scenes_hold_the_imported_pieces(folder: Path) -> None:
    world = WorldConfig(objects=(str(folder),), scales=2)
    bank = assembly.training_bank(world)
    assert [p.name for p in bank.pieces] == ["chair-train-003"] * 2 + ["low-stool-train-001"] * 2
    assert all(p.hulls for p in bank.pieces)
    both, _ = assembly.training_pieces(WorldConfig(objects=("train", str(folder)), pieces=5))
    assert len(both) == 7
    own, note = assembly.training_pieces(WorldConfig(pieces=5))
    assert (len(own), note) == (5, "")


@pytest.mark.parametrize(
    ("task", "objects", "code", "says"),
    [
        ("sit", "nowhere", 2, "nowhere"),
        ("sit", "test", 2, "the test pieces are held out; choose train or a path"),
        ("lie", "FOLDER", 1, "none of 3 pieces has a place to lie"),
        ("carry", "FOLDER", 2, "carry draws its boxes itself"),
    ],
)
def test_mistakes_are_one_line_and_leave_no_run(
    task: str, objects: str, code: int, says: str, tmp_path: Path, folder: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    run = tmp_path / "run"
    named = str(folder) if objects == "FOLDER" else objects
    assert main(["train", task, "--run", str(run), "--objects", named, *SMALL]) == code
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1
    assert not (run / "config.json").exists()
