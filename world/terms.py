"""Source, authors and licence of a data file, from what stands beside it.

In this order: a file FILE.license, as the REUSE specification names it; the nearest catalogue that
lists the file; README and LICENSE of its folder, and of the two folders above, as in data sets with
a folder for each person.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from world import catalogues

#: Characters of other text before the licence, from which on the sentences before it are left out.
_ASIDE = 100
_TERMS = ("non-commercial", "noncommercial", "research only")
#: A line that states a licence and does not only mention one.
_STATED = re.compile(r"^\W*licen[cs]es?\b[^\w|]*[:.,]", re.IGNORECASE)
#: A line that begins something new: a heading, table, quotation or list, or a field ("Source: ").
_BEGINS = re.compile(r"^\s*(?:[#|>`=]|[-*+] |---|\*\*\w|\d+[.)] |[\w ]{1,24}: )")
#: Characters from which on a line of a licence is prose that goes on, and no heading.
_PROSE = 50
_SPDX = re.compile(r"SPDX-License-Identifier:\s*(.+)", re.IGNORECASE)
_COPYRIGHT = re.compile(r"SPDX-FileCopyrightText:\s*(.+)", re.IGNORECASE)
_READMES = ("readme.md", "readme.txt", "readme.rst", "readme")
_LICENCES = ("license", "licence", "copying")
_BYTES = 1 << 20


@dataclass(frozen=True)
class Terms:
    """Where a file is from and under which terms; empty where nothing states it."""

    licence: str = ""
    """Whole, as stated"""
    source: str = ""
    credit: str = ""


def of(path: Path) -> Terms:
    """Return the terms of a file."""
    found = catalogues.row_of(path)
    row = found[0] if found else catalogues.Row("")
    own = _lines(path.parent / f"{path.name}.license")
    licence = _reuse(own) or row.licence
    for level, folder in enumerate(path.absolute().parents[: 1 + catalogues.ABOVE]):
        licence = licence or _of_folder(folder, own=level == 0)
    return Terms(licence, row.source, row.credit)


def _of_folder(folder: Path, own: bool) -> str:
    """The licence that README or LICENSE of a folder state; empty where they state none.

    own: the folder of the file; READMEs of those above may mention licences of other things.
    """
    files = _named(folder)
    for name in _READMES:
        lines = _lines(files[name]) if name in files else []
        stated = [at for at, line in enumerate(lines) if _STATED.match(line)]
        if stated:
            return _cleaned(_to_the_end(lines, stated[0]))
        for words in (("licence", "license"), _TERMS) if own else ():
            for at, line in enumerate(lines):
                if any(word in line.lower() for word in words) and not line.startswith("|"):
                    first = _beginning(lines, at)
                    return _from(_to_the_end(lines, first).replace("**", ""), words)
    for name in sorted(files):
        if name.split(".")[0] in _LICENCES and name.endswith((*_LICENCES, ".md", ".txt")):
            every = [line.strip("# \t") for line in _lines(files[name])]
            lines = [line for line in every if line.strip("=- ")]
            if lines and _SPDX.search(lines[0]):
                return _reuse(lines)
            if lines:
                return _heading(every)
    return ""


def _goes_on(line: str) -> bool:
    """Whether a line goes on with the sentences of the one before, in a text of wrapped lines."""
    return bool(line.strip()) and not _BEGINS.match(line)


def _to_the_end(lines: list[str], at: int) -> str:
    """A line with those that go on with its sentences."""
    parts = [lines[at].strip()]
    for line in lines[at + 1 :]:
        if not _goes_on(line):
            break
        parts.append(line.strip())
    return " ".join(parts)


def _beginning(lines: list[str], at: int) -> int:
    """The line in which the sentences of a line begin."""
    while at > 0 and _goes_on(lines[at]) and lines[at - 1].strip():
        if lines[at - 1].lstrip().startswith(("#", "|")):
            break
        at -= 1
    return at


def _heading(lines: list[str]) -> str:
    """The first two lines of a licence, and what goes on with their sentences: headings are
    short."""
    at = [at for at, line in enumerate(lines) if line.strip("=- ")][:2]
    first = lines[at[0]].strip()
    if len(at) == 1:
        return first
    if len(first) >= _PROSE and at[1] == at[0] + 1:
        return _to_the_end(lines, at[0])
    second = lines[at[1]].strip()
    return f"{first} {_to_the_end(lines, at[1]) if len(second) >= _PROSE else second}"


def _named(folder: Path) -> dict[str, Path]:
    """The files of a folder by their names in small letters."""
    try:
        return {path.name.lower(): path for path in sorted(folder.iterdir()) if path.is_file()}
    except OSError:
        return {}


def _lines(path: Path) -> list[str]:
    """The lines of a text file; none where it cannot be read."""
    try:
        with path.open("rb") as file:
            return file.read(_BYTES).decode("utf-8-sig", errors="replace").splitlines()
    except OSError:
        return []


def _reuse(lines: list[str]) -> str:
    """The identifier and the copyright of a REUSE file; without them its first line."""
    found = [match[1].strip() for match in map(_SPDX.search, lines) if match]
    owners = [match[1].strip() for match in map(_COPYRIGHT.search, lines) if match]
    if not found:
        return next(_stripped(lines), "")
    return ", ".join([" AND ".join(found), *(f"(c) {owner}" for owner in owners)])


def _stripped(lines: list[str]) -> Iterator[str]:
    return (line.strip() for line in lines if line.strip())


def _cleaned(line: str) -> str:
    return line.replace("**", "").strip(" -*#")


def _from(line: str, words: tuple[str, ...]) -> str:
    """A line from the sentence with one of the words on, where that comes late."""
    at = min(place for word in words if (place := line.lower().find(word)) >= 0)
    start = 0 if at < _ASIDE else line.rfind(". ", 0, at) + 1
    return line[max(start, 0) :].strip(" -*")
