"""What stands beside mesh files about them: a catalog.csv with a line a file, and the terms of the
libraries that it names in the folder's README."""

import csv
import re
from dataclasses import dataclass
from pathlib import Path

CATALOGUE = "catalog.csv"
#: A line of terms: `Licences: NAME: TERMS, (c) OWNER; NAME: TERMS`, perhaps an item of a list.
_LINE = re.compile(r"^\W*licen[cs]es?\W*:\W*(.+)$", re.IGNORECASE)
#: One library's terms end with a semicolon or a sentence.
_END = re.compile(r";|\.\s+(?=[A-Z])|$")
_OWNER = re.compile(r"(?:\(c\)|©).*", re.IGNORECASE)


@dataclass(frozen=True)
class Note:
    """Of one file; empty where nothing is said."""

    licence: str = ""
    credit: str = ""
    """Its creator, and the owner of its library, whom its licence may ask to name."""


def of_folder(folder: Path) -> dict[str, Note]:
    """The notes on a folder's files by their names without suffix (columns file, creator, licence;
    or library, whose licence the README then gives)."""
    try:
        with (folder / CATALOGUE).open(newline="") as file:
            rows = [row for row in csv.DictReader(file) if row.get("file")]
    except (OSError, csv.Error, UnicodeDecodeError):
        return {}
    terms = _terms(folder, {row.get("library") or "" for row in rows} - {""})
    return {row["file"]: _note(row, terms.get(row.get("library") or "", Note())) for row in rows}


def _note(row: dict[str, str], library: Note) -> Note:
    named = [text for text in (row.get("creator") or "", library.credit) if text]
    return Note(row.get("licence") or row.get("license") or library.licence, ", ".join(named))


def _terms(folder: Path, libraries: set[str]) -> dict[str, Note]:
    """What the README's line of licences says of these libraries."""
    try:
        lines = (folder / "README.md").read_text(errors="replace").splitlines()
    except OSError:
        return {}
    found = {}
    for stated in (match[1] for match in map(_LINE.match, lines) if match):
        for name in libraries:
            # an item begins with the name: the end of a longer name, as of "Big Lib", is no match
            start = re.search(rf"(?:^|[;,.]\s)\W*{re.escape(name)}\s*:\s*", stated)
            if start is None:
                continue
            text = stated[start.end() :]
            end = _END.search(text)
            assert end is not None  # the end of the text at least
            text = text[: end.start()].strip()
            owner = _OWNER.search(text)
            licence = text.split(",")[0].strip()
            found[name] = Note(licence, owner[0].strip() if owner else "")
    return found
