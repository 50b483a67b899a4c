"""Long commands say what they do, and how much of it is done."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from console import terminal
from console.app import main
from console.terminal import Work
from tests.support import foreign_motions, small_clips
from world.motions.synthetic import library


class Told(list[Callable[[], str]]):
    """The stages of a command, and what each said as it began."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[str] = []

    def append(self, stage: Callable[[], str]) -> None:
        super().append(stage)
        self.said.append(stage())


class Counted(list[Work]):
    """The counted work of a command."""

    def __init__(self) -> None:
        super().__init__()
        self.every: list[Work] = []

    def append(self, work: Work) -> None:
        super().append(work)
        self.every.append(work)


def told(words: list[str], monkeypatch: pytest.MonkeyPatch) -> tuple[list[str], dict[str, float]]:
    """What a command says that it does, and what it has counted to the end, by unit."""
    stages, works = Told(), Counted()
    monkeypatch.setattr(terminal, "_stages", stages)
    monkeypatch.setattr(terminal, "_works", works)
    assert main(words) == 0
    assert not stages and not works
    return stages.said, {work.unit: work.total for work in works.every if work.done >= work.total}


def test_synthesize(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ["synthesize", "walk", "--seconds", "0.2", "--out", str(tmp_path / "a.npz")]
    stages, counted = told(words, monkeypatch)
    assert {"reading the policy", "building the scene", "simulating", "writing a.npz"} <= {*stages}
    assert counted == {"frames": 7}


def test_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = ["--out", str(tmp_path / "a.html"), "--motions", str(small_clips.write(tmp_path / "c"))]
    stages, counted = told(["report", "walk", "--trials", "3", *out], monkeypatch)
    assert {
        "reading the policy", "reading clips", "simulating", "measuring motion quality", "drawing",
    } <= {*stages}  # fmt: skip
    assert counted == {"trials": 3, "pictures": 3}


def test_distill(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clips = str(small_clips.write(tmp_path / "clips"))
    words = ["distill", "sit", str(tmp_path / "out"), "--world.walker", "walk", "--first", "64"]
    small = ["--motions", clips, "--scenes", "8", "--world.pieces", "2", "--world.scales", "1"]
    end = ["--batches", "2", "--batch", "16", "--hidden", "16", "16"]
    stages, counted = told([*words, *small, *end], monkeypatch)
    assert "the workers build their scenes" in stages and "fitting the normaliser" in stages
    assert any(stage.startswith("training the student, batch 0 of 2, 0.0 of") for stage in stages)
    assert counted == {"samples": 64}


def test_import_of_objects(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "in").mkdir()
    for name in ("a", "b"):
        trimesh.creation.box((0.4, 0.4, 0.45)).export(tmp_path / "in" / f"{name}.obj")
    out = ["--out", str(tmp_path / "out"), "--category", "low-stool", "--up", "+z"]
    stages, counted = told(["objects", "import", str(tmp_path / "in"), *out], monkeypatch)
    assert "importing" in stages and counted == {"pieces": 2}


def test_import_check_and_variants_of_motions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip = library.walking(np.random.default_rng(0), 1.2).part(30, 54)
    for name in ("a", "b", "c"):
        foreign_motions.bvh_of(tmp_path / f"{name}.bvh", clip)
    out = str(tmp_path / "out")
    stages, counted = told(["motions", "import", str(tmp_path), "--out", out], monkeypatch)
    assert "importing" in stages and counted == {"motions": 3}
    stages, counted = told(["motions", "check", out], monkeypatch)
    assert "measuring" in stages and counted == {"motions": 3}
    stages, counted = told(["motions", "list", out], monkeypatch)
    assert "reading clips" in stages and counted == {"files": 3}


def test_train(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What it begins from, and that its scenes are waited for before a checkpoint is restored."""
    run, clips = str(tmp_path / "run"), str(small_clips.write(tmp_path / "clips"))
    small = ["--scenes", "32", "--block", "16", "--horizon", "4", "--world.pieces", "2"]
    quick = ["--world.scales", "1", "--clone-samples", "64", "--threads", "2", "--motions", clips]
    words = ["train", "sit", "--run", run, *small, *quick, "--style.normaliser-samples", "500"]
    stages, _ = told([*words, "--iterations", "1"], monkeypatch)
    assert "building scenes" in stages and "behaviour cloning on the clips" in stages
    assert "restoring the checkpoint" not in stages
    stages, _ = told([*words, "--iterations", "2", "--resume"], monkeypatch)
    assert "behaviour cloning on the clips" not in stages
    at = stages.index("restoring the checkpoint")
    assert stages[at - 1] == "building scenes"
    again = ["--run", str(tmp_path / "other"), "--init", run, "--iterations", "1"]
    stages, _ = told(["train", "sit", *small, *quick, *again], monkeypatch)
    assert "reading the networks to begin from" in stages
