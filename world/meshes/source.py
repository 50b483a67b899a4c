"""Reader of mesh files with bounded size; unreadable ones are refused in one line."""

import io
import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from world.errors import ChoiceError, PieceError
from world.refusals import refusing

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
    """The mesh of a file. Raises PieceError, ChoiceError for a format that is not read."""
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise PieceError(f"{path.name}: {size / 1e6:.0f} MB; at most {MAX_BYTES / 1e6:.0f} MB")
        content = path.read_bytes()
    except OSError as error:
        raise PieceError(f"cannot read {path}: {error.strerror}") from error
    return parse(content, path.name, path.parent)


def parse(content: bytes, file_name: str, folder: Path | None = None) -> Source:
    """The mesh in the bytes of a file; folder: of the files that a .gltf refers to.

    Raises PieceError, ChoiceError for a format that is not read.
    """
    name, suffix = Path(file_name).stem, Path(file_name).suffix.lower()
    with refusing(PieceError, Path(file_name), f"{suffix} file"):
        return _parsed(content, file_name, name, suffix, folder)


def _parsed(content: bytes, file_name: str, name: str, suffix: str, folder: Path | None) -> Source:
    if suffix not in SUFFIXES:
        raise ChoiceError("mesh format", suffix or file_name, [*SUFFIXES, ".sh3f"])
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
    """Vertices, faces and credit, as trimesh reads them."""
    import trimesh
    from trimesh.resolvers import FilePathResolver

    resolver = None
    if suffix == ".gltf" and folder is not None:
        _no_way_out(content, file_name)
        resolver = FilePathResolver(str(folder))
    options: dict[str, Any] = {"skip_materials": True} if suffix == ".obj" else {}
    try:
        scene = trimesh.load_scene(
            io.BytesIO(content),
            file_type=suffix[1:],
            resolver=resolver,
            process=False,
            **options,
        )
        parts = [g for g in scene.dump() if isinstance(g, trimesh.Trimesh)]
        credit = str(scene.metadata.get("copyright") or "")
    except MemoryError:
        raise  # not a fault of the file
    except Exception as error:
        detail = " ".join(str(error).split())[:120] or type(error).__name__
        raise PieceError(f"{file_name}: not a readable {suffix} file ({detail})") from error
    vertices = [np.asarray(part.vertices, dtype=np.float64) for part in parts]
    starts = np.cumsum([0, *(len(v) for v in vertices)])
    faces = [
        np.asarray(part.faces, dtype=np.int64) + start
        for part, start in zip(parts, starts[:-1], strict=True)
    ]
    if not faces:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64), credit
    return np.concatenate(vertices), np.concatenate(faces), credit


def _no_way_out(content: bytes, file_name: str) -> None:
    """Refuse a .gltf that refers to files outside its folder."""
    try:
        named = json.loads(content)
        uris = [e.get("uri", "") for k in ("buffers", "images") for e in named.get(k, [])]
    except (ValueError, AttributeError) as error:
        raise PieceError(f"{file_name}: not a readable .gltf file ({error})") from error
    for uri in uris:
        if uri.startswith("data:"):
            continue
        if Path(uri).is_absolute() or ".." in Path(uri).parts or "://" in uri:
            raise PieceError(f"{file_name}: it names a file outside its folder: {uri[:80]}")


def _announced(content: bytes, suffix: str) -> int:
    """Number of triangles that the file states, before they are read; 0 where that is expensive."""
    if suffix == ".obj":
        return content.count(b"\nf ") + content.startswith(b"f ")
    if suffix == ".stl":
        return _stl_triangles(content)
    if suffix == ".ply":
        for line in content[:4096].split(b"\n"):
            words = line.split()
            if words[:2] == [b"element", b"face"] and len(words) == 3 and words[2].isdigit():
                return int(words[2])
        return 0
    return _gltf_triangles(content, suffix)


def _stl_triangles(content: bytes) -> int:
    if len(content) >= 84:
        (count,) = struct.unpack("<I", content[80:84])
        if len(content) == 84 + 50 * count:
            return int(count)
    return content.count(b"endfacet")


def _gltf_triangles(content: bytes, suffix: str) -> int:
    """Triangles of all primitives, counted once for each node that uses the mesh."""
    try:
        text = content
        if suffix == ".glb":
            (length,) = struct.unpack("<I", content[12:16])
            text = content[20 : 20 + length]
        named = json.loads(text)
        shown = [n["mesh"] for n in named.get("nodes", []) if "mesh" in n]
        total = 0
        for mesh in shown:
            for primitive in named["meshes"][mesh]["primitives"]:
                key = primitive.get("indices", primitive["attributes"]["POSITION"])
                total += named["accessors"][key]["count"] // 3
        return total
    except (ValueError, KeyError, IndexError, TypeError, struct.error):
        return 0
