"""Licences and credits beside mesh files: a catalog.csv with one line per file, and the terms of
its libraries in the folder's README."""

import re
from dataclasses import dataclass
from pathlib import Path

from world import catalogues, terms
from world.catalogues import Row

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
    """The note of a mesh file: from the nearest catalogue that lists it, or from what else states
    terms beside it (world.terms)."""
    found = catalogues.row_of(path)
    if found is None:
        stated = terms.of(path)
        return Note(stated.licence, stated.credit)
    row, folder = found
    note = _note(row, _terms(folder, {row.source} - {""}).get(row.source, Note()))
    return note if note.licence else Note(terms.of(path).licence, note.credit)


def of_folder(folder: Path) -> dict[str, Note]:
    """The notes of a folder's files, by their names in its catalogue (columns file, creator, and
    licence or library, whose licence the README gives)."""
    rows = [row for catalogue in catalogues.of_folder(folder) for row in catalogue.rows]
    named = _terms(folder, {row.source for row in rows} - {""})
    return {row.file: _note(row, named.get(row.source, Note())) for row in rows}


def _note(row: Row, library: Note) -> Note:
    named = [text for text in (row.credit, library.credit) if text]
    return Note(row.licence or library.licence, ", ".join(named))


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
