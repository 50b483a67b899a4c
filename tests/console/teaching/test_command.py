"""`inhabit teach`: help, and one clear line with exit code 2 for flags that are out of bounds."""

import shutil
from pathlib import Path

import pytest

from console.app import main
from policy.checkpoints.format import read_manifest
from tests.support.paths import ROOT


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("teach --help", "carry"),
        ("teach carry --help-all", "--lifted"),
        ("teach try --help", "--noise"),
        ("teach record --help", "--clips"),
        ("--help", "teach carry|try|record"),
    ],
)
def test_help(words: str, expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words.split()) == 0
    assert expected in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("carry OUT --workers 0", "--workers 0: must be 1 to 1024"),
        ("carry OUT --minutes nan", "--minutes nan: must be 0.001 to 1000000"),
        ("carry OUT --minutes -1", "--minutes -1: must be 0.001 to 1000000"),
        ("carry OUT --batches 0", "--batches 0: must be 1 to 1000000000"),
        ("carry OUT --in-hand 1.5", "--in-hand 1.5: must be 0 to 1"),
        ("carry OUT --spell 0 10", "--spell 0: must be 0.001 to 1000000"),
        ("carry OUT --init sit", "--init sit is a policy of sit: choose one of carry"),
        ("carry TMP", "is not a checkpoint: choose another folder"),
        ("try --noise -1", "--noise -1: must be 0 to 10"),
        (
            "try --near-m 3 --far-m 2",
            "--near-m 3 --far-m 2: the first must be above 0, the second no less",
        ),
        ("record OUT --clips 0", "--clips 0: must be 1 to 1000000"),
        ("juggle", "juggle: no command of inhabit teach: choose one of carry, try, record"),
    ],
)
def test_bad_flags(
    words: str, line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    places = {"OUT": str(tmp_path / "out"), "TMP": str(tmp_path)}
    assert main(["teach", *(places.get(word, word) for word in words.split())]) == 2
    text = capsys.readouterr().err.strip()
    assert text.startswith("inhabit: ") and line in text and "\n" not in text
    assert not (tmp_path / "out").exists()


def test_missing_checkpoints_fail(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for flag in ("--init", "--walker"):
        words = ["teach", "carry", str(tmp_path / "out"), flag, str(tmp_path / "none")]
        assert main(words) == 2
        text = capsys.readouterr().err.strip()
        assert text.startswith("inhabit: ") and "none" in text and "\n" not in text


@pytest.mark.parametrize(
    "words", [["distill", "sit", "OUT", "--world.walker", "walk"], ["teach", "carry", "OUT"]]
)
def test_an_existing_checkpoint_is_replaced_on_request_alone(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    shutil.copytree(ROOT / "pretrained" / "walk", out)
    (out / "mine.txt").write_text("x")
    given = [str(out) if word == "OUT" else word for word in words]
    for more, why in (([], "add --replace"), (["--replace"], "holds mine.txt")):
        assert main([*given, *more]) in (1, 2)
        assert why in capsys.readouterr().err
        assert (out / "mine.txt").exists() and (out / "policy.safetensors").exists()


def test_a_student_begins_as_a_policy_with_a_linear_map(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert not read_manifest(ROOT / "pretrained" / "carry").layout.skip
    assert main(["teach", "carry", str(tmp_path / "out"), "--init", "carry"]) == 2
    text = capsys.readouterr().err.strip()
    assert (
        text.startswith("inhabit: --init carry: its actor has no linear map") and "\n" not in text
    )
    assert text.endswith("choose a checkpoint of inhabit teach carry") and "--ppo" not in text


def test_training_refuses_an_unknown_teacher(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    for task, name, line in (
        ("carry", "crab", "unknown --world.teacher 'crab': choose one of carry"),
        ("sit", "carry", "--world.teacher carry does not teach the task sit: leave it out"),
    ):
        assert main(["train", task, "--run", str(run), "--world.teacher", name]) == 2
        assert capsys.readouterr().err.strip() == f"inhabit: {line}"
    assert not run.exists()
