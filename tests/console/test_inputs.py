"""Paths of input that are not there are wrong usage, dry or not."""

from pathlib import Path

import pytest

from console.app import main
from tests.support.console.runs import said

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
]


@pytest.mark.parametrize("line", LINES)
def test_a_missing_input_is_refused(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(line.split()) == 2
    text = said(capsys)
    flag = next(word for word in reversed(line.split()) if word.startswith("--"))
    assert text.startswith(f"inhabit: {flag} nothere: no such ")
    assert not list(tmp_path.iterdir())


def test_names_and_splits_are_taken(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["train", "sit", "--dry-run", "--init", "walk", "--objects", "train"]) == 0
    assert '"objects"' in capsys.readouterr().out
