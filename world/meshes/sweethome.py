"""Sweet Home 3D furniture libraries, `.sh3f`: a zip with a catalogue and its OBJ files.

Format: http://www.sweethome3d.com/importModels.jsp and its FurnitureCatalog properties: sizes in
cm, y up, front +z, `modelRotation` nine numbers row by row.
"""

import io
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

import numpy as np

from world.errors import ChoiceError, PieceError
from world.meshes.frame import Frame
from world.meshes.source import SUFFIXES, Source, parse
from world.refusals import reason, refusing

CATALOGUE = "PluginFurnitureCatalog.properties"
MAX_ENTRY_BYTES = 64 * 1024 * 1024
MAX_TOTAL_BYTES = 1024 * 1024 * 1024
MAX_ENTRIES = 20_000
_CHUNK = 1 << 20


@dataclass(frozen=True)
class Entry:
    """One piece of a library, or the reason why it is refused."""

    name: str
    title: str
    category: str
    licence: str
    credit: str
    frame: Frame
    content: bytes
    """Content of the mesh file, not parsed."""
    rotation: tuple[float, ...]
    """Nine numbers, row by row: rotation of the model to upright."""
    refused: str = ""
    """Reason of the refusal; empty without one."""


def source(entry: Entry) -> Source:
    """The entry's mesh, turned upright by the catalogue's rotation. Raises PieceError."""
    with refusing(PieceError, Path(entry.name), "mesh"):
        found = parse(entry.content, f"{entry.name}.obj")
        turn = np.array(entry.rotation).reshape(3, 3)
        return replace(found, name=entry.name, vertices=found.vertices @ turn.T)


def entries(path: Path) -> Iterator[Entry]:
    """Yield the furniture of a library; a piece that cannot be read has `refused` set.

    Raises PieceError for a damaged library.
    """
    try:
        archive = zipfile.ZipFile(path)
    except (OSError, zipfile.BadZipFile) as error:
        raise PieceError(f"{path.name}: not a .sh3f library ({reason(error)})") from error
    with archive:
        _bounded(archive, path.name)
        names = set(archive.namelist())
        if CATALOGUE not in names:
            raise PieceError(f"{path.name}: no {CATALOGUE} in it; is it a furniture library?")
        text = _content(archive, CATALOGUE).decode("latin-1")
        found = properties(text)
        index = 1
        while f"name#{index}" in found:
            yield _entry(archive, names, found, index, path.stem)
            index += 1
        if index == 1:
            raise PieceError(f"{path.name}: its catalogue names no furniture")


def properties(text: str) -> dict[str, str]:
    """A Java properties file: keys and values, with continued lines and escapes."""
    result: dict[str, str] = {}
    pending = ""
    for raw in io.StringIO(text):
        # `#` begins a comment only at the start of a line; keys contain one further on
        if not pending and (not raw.strip() or raw.strip()[0] in "#!"):
            continue
        line, pending = pending + raw.strip(), ""
        if line.endswith("\\"):
            pending = line[:-1]
            continue
        cut = min((line.find(c) for c in "=:" if c in line), default=-1)
        if cut < 0:
            continue
        value = line[cut + 1 :].strip()
        try:
            value = value.encode("latin-1", "backslashreplace").decode("unicode_escape")
        except UnicodeDecodeError:
            value = line[cut + 1 :].strip()
        result[line[:cut].strip()] = value
    return result


def _bounded(archive: zipfile.ZipFile, name: str) -> None:
    """Refuse archives that state too many files or bytes, or paths outside the library."""
    files = archive.infolist()
    total = sum(file.file_size for file in files)
    if len(files) > MAX_ENTRIES or total > MAX_TOTAL_BYTES:
        raise PieceError(
            f"{name}: {len(files)} files of {total / 1e6:.0f} MB unpacked; "
            f"at most {MAX_ENTRIES} of {MAX_TOTAL_BYTES / 1e6:.0f} MB"
        )
    for file in files:
        parts = PurePosixPath(file.filename.replace("\\", "/"))
        if parts.is_absolute() or ".." in parts.parts:
            raise PieceError(f"{name}: a path outside the library: {file.filename[:80]}")


def _content(archive: zipfile.ZipFile, name: str) -> bytes:
    """The bytes of an entry, at most MAX_ENTRY_BYTES whatever its header states."""
    parts, size = [], 0
    try:
        with archive.open(name) as stream:
            while chunk := stream.read(_CHUNK):
                size += len(chunk)
                if size > MAX_ENTRY_BYTES:
                    raise PieceError(f"{name}: more than {MAX_ENTRY_BYTES / 1e6:.0f} MB unpacked")
                parts.append(chunk)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, OSError, EOFError) as error:
        raise PieceError(f"{name}: cannot be unpacked ({reason(error)})") from error
    return b"".join(parts)


def _entry(
    archive: zipfile.ZipFile, names: set[str], found: dict[str, str], index: int, library: str
) -> Entry:
    def of(key: str, otherwise: str = "") -> str:
        return found.get(f"{key}#{index}", otherwise)

    title = of("name")
    path = of("model")
    name = f"{library}-{PurePosixPath(path).stem or index}"
    entry = Entry(
        name=name,
        title=title,
        category=of("category"),
        licence=of("license") or found.get("license", ""),
        credit=of("creator") or found.get("provider", ""),
        frame=Frame(),
        content=b"",
        rotation=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    )
    try:
        width, depth, height = (float(of(k)) / 100 for k in ("width", "depth", "height"))
        rotation = tuple(float(x) for x in of("modelRotation").split()) or entry.rotation
        if len(rotation) != 9 or not np.isfinite([*rotation, width, depth, height]).all():
            raise ValueError("modelRotation has nine numbers")
        if min(width, depth, height) <= 0.0:
            raise ValueError("sizes are above 0")
        # the front is +z and y is up: the piece's x is the depth
        frame = Frame("+y", "+z", size_m=(depth, width, height))
        inside = str(PurePosixPath(path.lstrip("/")))
        if ".." in PurePosixPath(inside).parts:
            raise PieceError(f"a path outside the library: {path[:80]}")
        if inside not in names:
            raise PieceError(f"its model is not in the library: {path[:80]}")
        if PurePosixPath(inside).suffix.lower() not in SUFFIXES:
            raise ChoiceError("mesh format", PurePosixPath(inside).suffix, [*SUFFIXES])
        content = _content(archive, inside)
        return replace(entry, frame=frame, content=content, rotation=rotation)
    except (ValueError, PieceError, ChoiceError) as error:
        return replace(entry, refused=f"{name}: {error}")
