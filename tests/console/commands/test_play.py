"""The flags of the player, as they are typed."""

from pathlib import Path

import pytest

from console.app import parse
from console.commands import Play


def test_words_become_settings() -> None:
    assert parse(["play", "runs/a", "lie=runs/b"]) == Play(("runs/a", "lie=runs/b"))
    words = ["play", "run", "--checkpoint", "latest", "--motions", "m", "n", "--no-open"]
    wanted = Play(("run",), "latest", motions=(Path("m"), Path("n")), open=False)
    assert parse(words) == wanted


def test_it_stays_on_this_machine_unless_told() -> None:
    found = parse(["play", "run"])
    assert found.listen.startswith("127.0.0.1:") and not found.allow_insecure_remote
    with pytest.raises(Exception, match="--checkpoint"):
        parse(["play", "run", "--checkpoint", "newest"])
