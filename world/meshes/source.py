"""Reader of mesh files with bounded size; unreadable ones are refused in one line."""

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError
from world.meshes.formats import gltf, obj, stl
from world.placeholders import read_bounded
from world.refusals import refusing, unknown_suffix, why

SUFFIXES = (".obj", ".glb", ".gltf", ".stl", ".ply")
MAX_BYTES = 256 * 1024 * 1024
MAX_TRIANGLES = 500_000
"""Greatest number of triangles: larger meshes are scans or scenes, to be decimated first."""


@dataclass(frozen=True)
class Source:
    """A mesh in the axes and unit of its file."""

    name: str
    vertices: NDArray[np.float64]
    """[n, 3]."""
    faces: NDArray[np.int64]
    """[m, 3]."""
    suffix: str
    """Suffix of the file, with the dot: some formats define the upward axis."""
    credit: str = ""
    """The author that the file states."""

    def triangles(self) -> NDArray[np.float64]:
        """[m, 3, 3]."""
        return self.vertices[self.faces]


def read(path: Path) -> Source:
    """The mesh of a file. Raises PieceError."""
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise PieceError(f"{path.name}: {size / 1e6:.0f} MB; at most {MAX_BYTES / 1e6:.0f} MB")
        data = read_bounded(path, MAX_BYTES)
    except OSError as error:
        raise PieceError(f"cannot read {path}: {error.strerror}") from error
    return parse(data, path.name, path.parent)


def parse(content: bytes, file_name: str, folder: Path | None = None) -> Source:
    """The mesh in the bytes of a file; folder: of the files that a .gltf refers to.

    Raises PieceError, also for a format that is not read.
    """
    name, suffix = Path(file_name).stem, Path(file_name).suffix.lower()
    with refusing(PieceError, Path(file_name), f"{suffix} file"):
        return _parsed(content, file_name, name, suffix, folder)


def _parsed(content: bytes, file_name: str, name: str, suffix: str, folder: Path | None) -> Source:
    if suffix not in SUFFIXES:
        read = ", ".join((*SUFFIXES, ".sh3f"))
        raise PieceError(f"{file_name}: {unknown_suffix(Path(file_name))}; meshes come as {read}")
    if not content.strip():
        raise PieceError(f"{file_name}: an empty file")
    announced = _announced(content, suffix)
    if announced > MAX_TRIANGLES:
        raise PieceError(_too_many(file_name, announced))
    vertices, faces, credit = _load(content, file_name, suffix, folder)
    if not len(faces):
        raise PieceError(f"{file_name}: no triangles in it")
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.shape[1] != 3:
        raise PieceError(f"{file_name}: corners of {vertices.shape[-1]} coordinates, not 3")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise PieceError(f"{file_name}: triangles without their corners; repair the mesh")
    if len(faces) > MAX_TRIANGLES:
        raise PieceError(_too_many(file_name, len(faces)))
    if not np.isfinite(vertices[faces]).all():
        raise PieceError(f"{file_name}: coordinates that are no numbers; repair the mesh")
    return Source(name, vertices, faces, suffix, credit)


def _too_many(file_name: str, count: int) -> str:
    return f"{file_name}: {count} triangles; decimate it to at most {MAX_TRIANGLES}"


def _load(
    content: bytes, file_name: str, suffix: str, folder: Path | None
) -> tuple[NDArray[np.float64], NDArray[np.int64], str]:
    """Vertices, triangles and the stated author. Raises PieceError."""
    try:
        match suffix:
            case ".obj":
                return *obj.read(content, file_name), ""
            case ".stl":
                return *stl.read(content, file_name), ""
            case ".ply":
                return *_ply(content), ""
            case _:
                return gltf.read(content, file_name, suffix, folder)
    except (MemoryError, PieceError):
        raise  # the first is not a fault of the file
    except Exception as error:
        raise PieceError(
            f"{file_name}: not a readable {suffix} file ({why(error, 120)})"
        ) from error


def _ply(content: bytes) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    import trimesh

    # comments name textures, which trimesh would look for
    header, end, body = content.partition(b"end_header")
    lines = header.splitlines(keepends=True)
    plain = b"".join(line for line in lines if not line.lstrip().startswith(b"comment"))
    found = trimesh.load_mesh(io.BytesIO(plain + end + body), file_type="ply", process=False)
    if not isinstance(found, trimesh.Trimesh):
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    return (
        np.asarray(found.vertices, dtype=np.float64).reshape(-1, 3),
        np.asarray(found.faces, dtype=np.int64).reshape(-1, 3),
    )


def _announced(content: bytes, suffix: str) -> int:
    """Number of triangles that the file states, before they are read; 0 where that is expensive."""
    if suffix == ".obj":
        return sum(content.count(b"\nf" + gap) for gap in (b" ", b"\t"))
    if suffix == ".stl":
        return stl.announced(content)
    if suffix == ".ply":
        for line in content[:4096].split(b"\n"):
            words = line.split()
            if words[:2] == [b"element", b"face"] and len(words) == 3 and words[2].isdigit():
                return int(words[2])
        return 0
    return gltf.announced(content, suffix)
