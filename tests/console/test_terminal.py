"""Tables in files are wide enough to be read."""

import io

import pytest
from rich.table import Table

from console.terminal import FILE_WIDTH, screen


def test_a_file_is_as_wide_as_it_should_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "20")
    stream = io.StringIO()
    monkeypatch.setattr("sys.stdout", stream)
    table = Table(*(f"column {i} of a wide table" for i in range(5)))
    console = screen()
    assert console.width == FILE_WIDTH
    console.print(table)
    assert "column 4 of a wide table" in stream.getvalue()


def test_text_is_shown_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """rich reads brackets as markup and names between colons as emoji, in lines, cells and
    titles."""
    text = "walk [take 1] [/x] [bold]:smile:"
    table = Table(text, title=text)
    table.add_row(text)
    output = screen()
    output.print(table)
    output.print(text)
    assert capsys.readouterr().out.count(text) == 4
