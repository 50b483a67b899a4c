"""The help fits a screen or two, on a narrow one too, and says where the rest is."""

import re

import pytest

from console import commands
from console.app import main
from console.manual import page
from console.manual.page import command, first_sentence, summary

ENTRIES = [*commands.COMMANDS, *(entry for group in commands.GROUPS for entry in group.entries)]


def flags_in(text: str) -> list[str]:
    return re.findall(r"^  (--[a-z][-a-z.]*)", text, re.MULTILINE)


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.flags.__name__)
@pytest.mark.parametrize(("width", "lines"), [(80, 54), (40, 120)])
def test_the_help_of_a_command_fits(entry: commands.Entry, width: int, lines: int) -> None:
    text = command(entry.name, entry.flags, width=width)
    rows = text.splitlines()
    assert len(rows) <= lines and max(map(len, rows)) <= width
    assert text.startswith(f"usage: inhabit {entry.name}") and "--debug" not in flags_in(text)
    everything = {f.typed for f in page.flags_of(entry.flags) if not f.positional}
    shown = set(flags_in(text))
    assert shown <= everything
    assert f"{len(everything - shown)} more flag" in text
    assert f"inhabit {entry.name} --help-all" in " ".join(text.split())


def test_words_are_whole_at_every_width() -> None:
    whole = set(command("serve", commands.Serve, width=100).split())
    for width in (40, 57, 80):
        assert set(command("serve", commands.Serve, width=width).split()) == whole


def test_the_top_level_lists_every_command_by_purpose(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    listed = re.findall(r"^  ([a-z]+) ", text, re.MULTILINE)
    assert sorted(listed) == sorted(e.name for e in (*commands.COMMANDS, *commands.GROUPS))
    assert len(text.splitlines()) <= 48 and text.index("demo") < text.index("doctor")
    assert main(["--help-all"]) == 0 and capsys.readouterr().out == text
    for group in commands.GROUPS:
        assert main([group.name, "--help"]) == 0
        inner = re.findall(r"^  ([a-z]+) ", capsys.readouterr().out, re.MULTILINE)
        assert inner == [entry.name for entry in group.entries]


def test_the_help_of_train_has_the_defaults_of_its_words(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["train", "track", "--help"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "over all actors (default: 256)" in text  # of the preset track
    assert "inhabit train track --help-all" in text
    assert main(["train", "walk", "-h"]) == 0
    assert "--objects" not in flags_in(capsys.readouterr().out)  # walk has none


def test_all_flags_stand_behind_help_all(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["evaluate"], ["motions", "check"]):
        assert main([*words, "--help-all"]) == 0
        text = capsys.readouterr().out
        kind = next(e.flags for e in ENTRIES if e.name == words[-1])
        assert all(f.flag in text for f in page.flags_of(kind) if not f.positional)


@pytest.mark.parametrize("flag", ["--help", "--help-all"])
@pytest.mark.parametrize("words", ["fly", "motions fly", "train fly"])
def test_unknown_words_are_refused_with_help_too(
    words: str, flag: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*words.split(), flag]) == 2
    out, err = capsys.readouterr()
    assert not out and err.startswith("inhabit: ") and err.count("\n") == 1 and "fly" in err


def test_clauses_and_sentences() -> None:
    assert summary(commands.Train) == "Train a policy for a task"
    assert summary(commands.Motions).startswith("import|list|check|play|vary: motion clips")
    assert first_sentence("Of 1.5 m. The other.") == "Of 1.5 m."
    assert first_sentence("Of 1.5 m") == "Of 1.5 m"
