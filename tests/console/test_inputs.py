"""Paths of input that are not there are wrong usage, dry or not."""

import dataclasses
import shutil
from pathlib import Path
from typing import Any

import pytest

from console import commands, inputs
from console.app import main
from console.run.experiment import Experiment
from tests.support.console.runs import said
from tests.support.paths import ROOT
from world.config import WorldConfig
from world.errors import ConfigError

LINES = [
    "train sit --dry-run --objects nothere",
    "train sit --dry-run --objects train nothere",
    "train sit --dry-run --motions nothere",
    "train sit --dry-run --init nothere",
    "train sit --objects nothere",
    "train sit --dry-run --style-service.token-file nothere",
    "evaluate sit --motions nothere",
    "realism sit --against nothere",
    "publish sit out --evaluation nothere",
    "serve sit --tls-cert nothere",
    "serve sit --token-file nothere",
    "style sit --tls-client-ca nothere",
    "motions import . --out out --map nothere",
    "bench furniture --objects nothere",
    "bench train --motions nothere",
    "bench profile --policy nothere",
    "synthesize sit --object chair-test-000 --out a.bvh --rig nothere",
    "export sit out.bvh --joint-map nothere",
    "motions import --out out nothere",
]
NOTHERE = Path("nothere")
WORDS: list[tuple[str, Any]] = [
    ("nothere", commands.Evaluate(NOTHERE)),
    ("nothere", commands.Report(NOTHERE)),
    ("nothere", commands.Publish(NOTHERE, Path("out"))),
    ("nothere", commands.Realism(NOTHERE)),
    ("nothere", commands.Video(NOTHERE)),
    ("nothere", commands.Export(NOTHERE, Path("out.onnx"))),
    ("nothere", commands.Style(NOTHERE)),
    ("nothere", commands.Play(("nothere",))),
    ("chair=nothere", commands.Play(("sit", "chair=nothere"))),
    ("chair=nothere", commands.Demo(("chair=nothere",))),
    ("nothere", commands.Serve(("sit", "nothere"))),
    ("nothere", commands.MotionsImport((NOTHERE,), Path("out"))),
    ("nothere", commands.MotionsList((NOTHERE,))),
    ("nothere", commands.MotionsCheck((NOTHERE,))),
    ("nothere", commands.MotionsVary((NOTHERE,), Path("out"))),
    ("nothere", commands.MotionsPlay((NOTHERE,))),
    ("nothere", commands.ObjectsImport((NOTHERE,), commands.Meshes())),
    ("nothere", commands.ObjectsList(("train", "nothere"))),
    ("nothere", commands.ObjectsCheck(("train", "nothere"), commands.Meshes())),
    ("nothere", commands.ObjectsShow(("nothere",))),
]


@pytest.mark.parametrize("line", LINES)
def test_a_missing_input_is_refused(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(line.split()) == 2
    text = said(capsys)
    flag = next(word for word in reversed(line.split()) if word.startswith("--"))
    named = "" if flag == "--out" else f"{flag} "
    assert text.startswith(f"inhabit: {named}nothere: no such ")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("word", "command"), WORDS)
def test_a_missing_run_or_file_is_refused(word: str, command: Any) -> None:
    with pytest.raises(ConfigError, match=f"^{word}: no such "):
        inputs.require(command)


def test_every_command_with_words_is_among_these() -> None:
    entries = (*commands.COMMANDS, *(entry for group in commands.GROUPS for entry in group.entries))
    words = {*inputs.RUNS[:3], *inputs.PATHS}
    reading = {
        entry.flags.__name__
        for entry in entries
        if words & {field.name for field in dataclasses.fields(entry.flags)}
    }
    tested = {type(command).__name__ for _, command in WORDS}
    # synthesis needs more flags than are worth it here
    assert reading == (tested | {"Synthesize"}) - {"ObjectsList", "ObjectsShow"}


def test_a_name_with_an_equals_sign_is_a_file_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a=b.npz").write_bytes(b"")
    inputs.require(commands.Play(("a=b.npz",)))


def test_names_and_splits_are_taken(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["train", "sit", "--dry-run", "--init", "walk", "--objects", "train"]) == 0
    assert '"objects"' in capsys.readouterr().out


def test_a_folder_with_the_name_of_a_policy_is_said_to_be_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["publish", "walk", "first"]) == 0
    assert capsys.readouterr().err == ""
    shutil.copytree(ROOT / "pretrained" / "sit", tmp_path / "walk")
    assert main(["publish", "walk", "second"]) == 0
    told = capsys.readouterr()
    line = "the folder here is used, not the package's policy of that name"
    assert told.err == f"note: walk: {line}\n"
    assert "SAMP" in told.out, "it is that of the folder"
    for command in (
        commands.Evaluate(Path("walk")),
        commands.Play(("walk",)),
        commands.Serve(("mine=walk",)),
        commands.Demo(("sit", "walk")),
        commands.Train("sit", Experiment(), init=Path("walk")),
        commands.Train("sit", Experiment(world=WorldConfig(walker="walk"))),
        commands.Distill("sit", Path("out"), world=WorldConfig(expert="walk")),
    ):
        assert list(inputs.namesakes(command)) == [f"walk: {line}"]
    # the package's own folder, a path, and what is no policy
    assert not [*inputs.namesakes(commands.Evaluate(tmp_path / "walk"))]
    assert not [*inputs.namesakes(commands.Doctor(policy="walk"))]
    monkeypatch.chdir(ROOT / "pretrained")
    assert not [*inputs.namesakes(commands.Evaluate(Path("walk")))]
