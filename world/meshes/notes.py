"""Licences and credits beside mesh files: a catalog.csv with one line per file, and the terms of
its libraries in the folder's README."""

import csv
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

CATALOGUE = "catalog.csv"
#: Folders above that of a file whose catalogue may list it.
_ABOVE = 2
#: A line of terms: `Licences: NAME: TERMS, (c) OWNER; NAME: TERMS`, possibly a list item.
_LINE = re.compile(r"^\W*licen[cs]es?\W*:\W*(.+)$", re.IGNORECASE)
#: The terms of a library end with a semicolon or a sentence.
_END = re.compile(r";|\.\s+(?=[A-Z])|$")
_OWNER = re.compile(r"(?:\(c\)|©).*", re.IGNORECASE)


@dataclass(frozen=True)
class Note:
    """Licence and credit of one file; empty where not stated."""

    licence: str = ""
    credit: str = ""
    """The creator, and the owner of the library, whom the licence may require to be named."""


def of_file(path: Path) -> Note:
    """The note of a mesh file, from the nearest catalogue that lists it: of its own folder, or of
    one of the two above, as where a library has a folder for each class."""
    known = _known(tuple(path.absolute().parents[: 1 + _ABOVE]))
    return next((notes[path.stem] for notes in known if path.stem in notes), Note())


@lru_cache(maxsize=64)
def _known(folders: tuple[Path, ...]) -> tuple[dict[str, Note], ...]:
    """The notes of folders, read once for all files of an import."""
    return tuple(map(of_folder, folders))


def of_folder(folder: Path) -> dict[str, Note]:
    """The notes of a folder's files, by their names without suffix (columns file, creator, and
    licence or library, whose licence the README gives)."""
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
    """The terms of these libraries in the README's lines of licences."""
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
