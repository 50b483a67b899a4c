"""Reader of the geometry of glTF 2.0 files (Khronos, "glTF 2.0 Specification"), `.gltf` and `.glb`.

trimesh leaves normalised integers as they are (KHR_mesh_quantization), does not decode URIs, and
replaces compressed geometry with zeros.
"""

import base64
import binascii
import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError

MAX_BYTES = 256 * 1024 * 1024
"""Greatest size of all buffers and accessors together."""
MOST_LEVELS = 200
"""Greatest depth of the tree of nodes."""

_TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
_SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
_HARMLESS = (
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_animation_pointer",
    "KHR_xmp",
)
"""Beginnings of extensions without which the geometry is the same."""

Document = dict[str, Any]
Matrix = NDArray[np.float64]


def document(content: bytes, suffix: str) -> tuple[Document, bytes]:
    """The JSON and the binary chunk of a file. Raises ValueError, struct.error."""
    binary = b""
    if suffix == ".glb":
        magic, version, _ = struct.unpack_from("<4sII", content)
        if magic != b"glTF" or version != 2:
            raise ValueError(f"version {version}; 2 is read" if magic == b"glTF" else "no glTF")
        at, text = 12, b""
        while at + 8 <= len(content):
            length, kind = struct.unpack_from("<I4s", content, at)
            chunk = content[at + 8 : at + 8 + length]
            if len(chunk) < length:
                raise ValueError("it is cut short")
            if kind == b"JSON" and not text:
                text = chunk
            elif kind == b"BIN\0" and not binary:
                binary = chunk
            at += 8 + length
        content = text
    found = json.loads(content)
    if not isinstance(found, dict):
        raise ValueError("no object of glTF")
    return found, binary


def announced(content: bytes, suffix: str) -> int:
    """Number of triangles of all primitives, counted once for each node that uses the mesh; 0 where
    the file does not state it."""
    try:
        named, _ = document(content, suffix)
        shown = [n["mesh"] for n in named.get("nodes", []) if "mesh" in n]
        total = 0
        for mesh in shown:
            for primitive in named["meshes"][mesh]["primitives"]:
                key = primitive.get("indices", primitive["attributes"]["POSITION"])
                total += named["accessors"][key]["count"] // 3
        return total
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, struct.error):
        return 0


def read(
    content: bytes, file_name: str, suffix: str, folder: Path | None
) -> tuple[NDArray[np.float64], NDArray[np.int64], str]:
    """Vertices [n, 3], triangles [m, 3] of the default scene, and the stated copyright.

    folder: of the buffers that the file refers to. Raises PieceError; any other exception for a
    damaged file.
    """
    named, binary = document(content, suffix)
    _refuse_outside(named, file_name)
    _refuse_extensions(named, file_name)
    reader = _Reader(named, binary, file_name, folder)
    vertices, triangles, start = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)], 0
    for mesh, placed in _shown(named, file_name):
        for points, faces in reader.primitives(mesh):
            vertices.append(points @ placed[:3, :3].T + placed[:3, 3])
            mirrored = np.linalg.det(placed[:3, :3]) < 0.0
            triangles.append((faces[:, ::-1] if mirrored else faces) + start)
            start += len(points)
    credit = str(named.get("asset", {}).get("copyright") or "")
    return np.concatenate(vertices), np.concatenate(triangles), credit


def _refuse_outside(named: Document, file_name: str) -> None:
    """Refuse a file that refers to files outside its folder."""
    for entry in (*named.get("buffers", []), *named.get("images", [])):
        uri = entry.get("uri", "")
        if uri.startswith("data:"):
            continue
        path = PurePosixPath(unquote(uri).replace("\\", "/"))
        if path.is_absolute() or ".." in path.parts or ":" in unquote(uri).partition("/")[0]:
            raise PieceError(f"{file_name}: it names a file outside its folder: {uri[:80]}")


def _refuse_extensions(named: Document, file_name: str) -> None:
    """Refuse extensions without which the geometry would be another."""
    for name in named.get("extensionsRequired", []):
        if name not in _COMPRESSED and not str(name).startswith(_HARMLESS):
            raise PieceError(
                f"{file_name}: it requires the extension {str(name)[:60]}, which is not read; "
                "export it without"
            )


def _compressed(extension: str, file_name: str) -> PieceError:
    return PieceError(
        f"{file_name}: its geometry is compressed with {_COMPRESSED[extension]} ({extension}), "
        "which is not read; export it without compression, or decompress it "
        "(gltf-transform copy IN.glb OUT.glb)"
    )


def _shown(named: Document, file_name: str) -> Iterator[tuple[int, Matrix]]:
    """Meshes with their placements [4, 4], of the default scene, else of all root nodes."""
    nodes = named.get("nodes", [])
    scenes = named.get("scenes", [])
    if scenes:
        roots = scenes[named.get("scene", 0)].get("nodes", [])
    else:
        children = {child for node in nodes for child in node.get("children", [])}
        roots = [index for index in range(len(nodes)) if index not in children]
    if not nodes:  # meshes alone
        yield from ((index, np.eye(4)) for index in range(len(named.get("meshes", []))))
        return
    waiting = [(int(root), np.eye(4), 0) for root in reversed(roots)]
    # a tree has no more visits than nodes
    visits = 0
    while waiting:
        index, parent, level = waiting.pop()
        visits += 1
        if level > MOST_LEVELS or visits > len(nodes) or index < 0:
            raise PieceError(f"{file_name}: its nodes are no tree; export it again")
        node = nodes[index]
        placed = parent @ _placement(node)
        if "mesh" in node:
            yield int(node["mesh"]), placed
        waiting += [(int(c), placed, level + 1) for c in reversed(node.get("children", []))]


def _placement(node: Document) -> Matrix:
    """The local transform [4, 4] of a node."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    result = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    result[:3, :3] = turn * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    result[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return result


@dataclass
class _Reader:
    """The buffers, accessors and primitives of a document."""

    named: Document
    binary: bytes
    file_name: str
    folder: Path | None
    read_bytes: int = 0
    buffers: dict[int, bytes] = field(default_factory=dict[int, bytes])

    def primitives(self, mesh: int) -> Iterator[tuple[NDArray[np.float64], NDArray[np.int64]]]:
        """Vertices and triangles of the primitives of a mesh; points and lines are left out."""
        for primitive in self.named["meshes"][mesh]["primitives"]:
            mode = primitive.get("mode", _TRIANGLES)
            if mode not in (_TRIANGLES, _STRIP, _FAN):
                continue
            position = primitive["attributes"]["POSITION"]
            stored = "bufferView" in self.named["accessors"][position]
            for extension in primitive.get("extensions", {}):
                if extension in _COMPRESSED and not stored:
                    raise _compressed(extension, self.file_name)
            points = self.accessor(position)
            if points.shape[1] != 3:
                raise ValueError(f"positions of {points.shape[1]} numbers")
            if "indices" in primitive:
                corners = self.accessor(primitive["indices"]).astype(np.int64)[:, 0]
            else:
                corners = np.arange(len(points))
            faces = _triangles(corners, mode)
            if len(faces) and int(faces.max()) >= len(points):
                raise ValueError("triangles without their corners")
            yield points, faces

    def accessor(self, index: int) -> NDArray[np.float64]:
        """The numbers [count, k] of an accessor; normalised integers as fractions."""
        entry = self.named["accessors"][index]
        count, width = int(entry["count"]), _SIZES[entry["type"]]
        kind = np.dtype("<" + _TYPES[entry["componentType"]])
        self._take(count * width * 8)
        if "bufferView" in entry:
            view, stride = self.view(entry["bufferView"])
            values = _strided(view, kind, count, width, stride, entry.get("byteOffset", 0))
        else:
            values = np.zeros((count, width), dtype=kind)
        if "sparse" in entry:
            values = self._replaced(values.copy(), entry["sparse"], kind)
        numbers = values.astype(np.float64)
        if entry.get("normalized") and kind.kind in "iu":
            numbers = np.maximum(numbers / np.iinfo(kind).max, -1.0)
        return numbers

    def view(self, index: int) -> tuple[bytes, int]:
        """The bytes of a buffer view and its stride; 0: packed."""
        entry = self.named["bufferViews"][index]
        buffer = self.named["buffers"][entry["buffer"]]
        for extension in entry.get("extensions", {}):
            # the buffer may hold the uncompressed data, too
            if extension in _COMPRESSED and "uri" not in buffer:
                raise _compressed(extension, self.file_name)
        start, length = int(entry.get("byteOffset", 0)), int(entry["byteLength"])
        content = self.buffer(entry["buffer"])[start : start + length]
        if start < 0 or len(content) < length:
            raise ValueError("its buffer is shorter than stated")
        return content, int(entry.get("byteStride", 0))

    def buffer(self, index: int) -> bytes:
        """The bytes of a buffer: the binary chunk, base64, or a file."""
        if index not in self.buffers:
            uri = self.named["buffers"][index].get("uri")
            if uri is None:
                if index != 0 or not self.binary:
                    raise PieceError(f"{self.file_name}: buffer {index} is not in the file")
                content = self.binary
            elif uri.startswith("data:"):
                try:
                    content = base64.b64decode(unquote(uri.partition(",")[2]))
                except binascii.Error as error:
                    raise ValueError(f"a buffer that is not base64: {error}") from error
            else:
                content = self._beside(uri)
            self._take(len(content))
            self.buffers[index] = content
        return self.buffers[index]

    def _beside(self, uri: str) -> bytes:
        """The bytes of a file that a buffer names."""
        name = unquote(uri)
        path = None if self.folder is None else self.folder / name
        if path is not None and not path.exists():
            path = self.folder / uri if self.folder is not None else None  # not encoded
        if path is None or not path.is_file():
            raise PieceError(
                f"{self.file_name}: its geometry is in {name[:120]}, which is not beside it; put "
                "that file into the same folder, or export one .glb"
            )
        if path.stat().st_size > MAX_BYTES:
            raise PieceError(
                f"{self.file_name}: {name[:80]} has more than {MAX_BYTES / 1e6:.0f} MB"
            )
        try:
            return path.read_bytes()
        except OSError as error:
            raise PieceError(
                f"{self.file_name}: cannot read {name[:80]}: {error.strerror}"
            ) from error

    def _take(self, size: int) -> None:
        """Count bytes that are read. Raises PieceError beyond MAX_BYTES."""
        self.read_bytes += size
        if size < 0 or self.read_bytes > MAX_BYTES:
            raise PieceError(f"{self.file_name}: more than {MAX_BYTES / 1e6:.0f} MB of geometry")

    def _replaced(
        self, values: NDArray[Any], sparse: Document, kind: np.dtype[Any]
    ) -> NDArray[Any]:
        """The values with those of a sparse accessor put in."""
        count = int(sparse["count"])
        where, what = sparse["indices"], sparse["values"]
        at, _ = self.view(where["bufferView"])
        new, _ = self.view(what["bufferView"])
        key = np.dtype("<" + _TYPES[where["componentType"]])
        index = _strided(at, key, count, 1, 0, where.get("byteOffset", 0))[:, 0]
        values[index] = _strided(new, kind, count, values.shape[1], 0, what.get("byteOffset", 0))
        return values


def _strided(
    view: bytes, kind: np.dtype[Any], count: int, width: int, stride: int, offset: int
) -> NDArray[Any]:
    """[count, width] numbers of a view. Raises ValueError where it is too short."""
    packed = kind.itemsize * width
    stride = stride or packed
    if (
        offset < 0
        or stride < packed
        or (count and offset + stride * (count - 1) + packed > len(view))
    ):
        raise ValueError("an accessor beyond its buffer")
    return np.ndarray((count, width), kind, view, offset, (stride, kind.itemsize))


def _triangles(corners: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """[m, 3] of the corners of a primitive."""
    if mode == _TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if len(corners) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    if mode == _FAN:
        first = np.broadcast_to(corners[0], len(corners) - 2)
        return np.stack((first, corners[1:-1], corners[2:]), axis=1)
    strip = np.stack((corners[:-2], corners[1:-1], corners[2:]), axis=1)
    strip[1::2] = strip[1::2, [1, 0, 2]]
    return strip
