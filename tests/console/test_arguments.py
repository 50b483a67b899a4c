"""Words that are no command: exit code 2 and one line that names what would be."""

import pytest

from console.app import main
from console.arguments import one_line

WRONG = [
    ("", "train, evaluate"),
    ("frobnicate", "frobnicate; Available subcommands: train, evaluate"),
    ("train", "TASK"),
    ("train sit --scnes 4", "--scnes, 4; Perhaps you meant: --scenes; see inhabit train --help"),
    ("train sit --runner cloud", "'cloud' for argument '--runner'. Expected one of ('local', "),
    ("train sit --preset big", "('fast', 'paper', 'track')"),
    ("train sit --scenes many", "--scenes: invalid literal for int() with base 10: 'many'"),
    ("train sit --scenes", "Missing value for argument '--scenes'"),
    ("bench worlds", "('world', 'servos', 'furniture', 'box', "),
    ("motions lits", "lits; Available subcommands: import, list, check"),
    ("motions", "list, check"),
    ("objects", "import, list, check, show"),
    ("objects lits", "lits; Available subcommands: import, list, check, show"),
]  # fmt: skip


@pytest.mark.parametrize("columns", ["80", "200"])
@pytest.mark.parametrize(("words", "named"), WRONG, ids=[words or "none" for words, _ in WRONG])
def test_one_line_names_the_choices(
    words: str,
    named: str,
    columns: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", columns)  # where tyro's box would wrap
    assert main(words.split()) == 2
    out, err = capsys.readouterr()
    assert not out and err.startswith("inhabit: ") and err.count("\n") == 1
    assert named in err


@pytest.mark.parametrize("words", ["--help", "train --help", "motions --help", "objects --help"])
def test_help_is_0_and_on_standard_output(words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words.split()) == 0
    out, err = capsys.readouterr()
    assert "usage: inhabit" in out and not err


def test_boxes_of_all_kinds() -> None:
    red = "\x1b[31m│\x1b[0m \x1b[1minvalid\x1b[0m    \x1b[31m│\x1b[0m\n"
    rule, footer = "│ ───────── │\n", "│ For full helptext, see it --help │\n"
    framed = f"╭─ Invalid ─╮\n{red}│ choice     │\n{rule}{footer}╰────╯\n"
    assert one_line(framed) == "invalid choice; see it --help"
    assert one_line(" Invalid \n ------ \n  no\n  -----\n  choice.\n \n") == "no; choice"
    assert one_line("some other\n  text\n") == "some other text"
