"""Catalogues of data folders: tables of files with their source, authors and licence."""

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

#: Names of a folder's catalogue, in any case.
CATALOGUES = ("catalog.csv", "catalogue.csv", "index.csv", "licences.csv", "licenses.csv")
#: Folders above that of a file whose catalogue may list it.
ABOVE = 2
_BYTES = 16 << 20
_COLUMNS = {
    "file": ("file", "filename", "file name", "name", "path", "clip"),
    "licence": ("licence", "license", "licences", "licenses", "licence_id", "spdx", "terms"),
    "source": ("source", "dataset", "library", "collection"),
    "credit": ("creator", "author", "authors", "credit", "attribution", "artist", "owner"),
}


@dataclass(frozen=True)
class Row:
    """What a catalogue says of one file; empty where it does not."""

    file: str
    """As written: a name with or without suffix, or a path from the catalogue's folder"""
    licence: str = ""
    source: str = ""
    """The data set or library that it is of"""
    credit: str = ""


@dataclass(frozen=True)
class Catalogue:
    """The rows of a folder's catalogue."""

    folder: Path
    rows: tuple[Row, ...] = ()

    def row(self, path: Path) -> Row | None:
        """Return the row of a file: by its path from this folder, else by its name, else by the
        name without suffix."""
        inside = path.absolute().relative_to(self.folder.absolute())
        for name in (
            inside.as_posix(),
            path.name,
            inside.with_suffix("").as_posix(),
            path.stem,
        ):
            for row in self.rows:
                if row.file.replace("\\", "/").removeprefix("./") == name:
                    return row
        return None


def row_of(path: Path) -> tuple[Row, Path] | None:
    """Return the row of a file and the folder of the nearest catalogue that lists it: that of its
    own folder, or of one of the two above; None where none does."""
    for folder in path.absolute().parents[: 1 + ABOVE]:
        for catalogue in of_folder(folder):
            row = catalogue.row(path)
            if row is not None:
                return row, folder
    return None


def of_folder(folder: Path) -> tuple[Catalogue, ...]:
    """Return the catalogues of a folder; a damaged one counts as none."""
    try:
        files = _files(folder, folder.stat().st_mtime_ns)
        return tuple(
            _read(file, found.st_mtime_ns, found.st_size)
            for file in files
            if (found := file.stat()).st_size <= _BYTES
        )
    except OSError:
        return ()


@lru_cache(maxsize=64)
def _files(folder: Path, _changed: int) -> tuple[Path, ...]:
    """The files of a folder that are catalogues by their names, listed once for all its files."""
    named = {path.name.lower(): path for path in sorted(folder.glob("*.[cC][sS][vV]"))}
    return tuple(named[name] for name in CATALOGUES if name in named and named[name].is_file())


@lru_cache(maxsize=64)
def _read(path: Path, _changed: int, _size: int) -> Catalogue:
    """Read a catalogue once for all files of its folder."""
    return Catalogue(path.parent, tuple(_rows(path)))


def _rows(path: Path) -> Iterator[Row]:
    """The rows of a table with a header; its delimiter is a comma, a semicolon or a tab."""
    text = path.read_bytes().decode("utf-8-sig", errors="replace")
    header = text.partition("\n")[0]
    delimiter = max(",;\t", key=header.count)
    try:
        for row in csv.DictReader(io.StringIO(text), delimiter=delimiter):
            own = {(k or "").strip().lower(): v.strip() for k, v in row.items() if type(v) is str}
            found = {
                field: next((own[name] for name in names if own.get(name)), "")
                for field, names in _COLUMNS.items()
            }
            if found["file"]:
                yield Row(**found)
    except csv.Error:
        return
