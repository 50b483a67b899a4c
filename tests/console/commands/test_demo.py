"""The flags of the demo, as they are typed."""

import pytest

from console.app import main, parse
from console.commands import Demo


def test_words_become_settings() -> None:
    assert parse(["demo"]) == Demo()
    wanted = Demo(("runs/a",), 3, "127.0.0.1:80", open=False)
    assert (
        parse(["demo", "runs/a", "--seed", "3", "--listen", "127.0.0.1:80", "--no-open"]) == wanted
    )


def test_help_lists_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    assert "demo" in capsys.readouterr().out
