"""glTF 2.0 files: buffers, accessors and the container (Khronos, "glTF 2.0 Specification").

`.glb` is one binary file; `.gltf` is JSON with the same bytes as a data URI.
"""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from world.errors import ClipError
from world.meshes.formats import gltf
from world.refusals import reason

Document = dict[str, Any]
SUFFIXES = (".glb", ".gltf")
_COMPONENTS = {"f4": 5126, "u4": 5125, "u2": 5123, "u1": 5121}
_TYPES = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
VERTICES, INDICES = 34962, 34963
"""Targets of buffer views: ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER."""
_URI = "data:application/octet-stream;base64,"


class Writer:
    """A document under construction, with one binary buffer."""

    def __init__(self, document: Document | None = None, binary: bytes = b"") -> None:
        self.document: Document = document or {"asset": {"version": "2.0"}}
        self._binary = bytearray(binary)

    def add(self, kind: str, entry: Any) -> int:
        """Add an entry to an array of the document, such as nodes; return its index."""
        entries = self.document.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def accessor(
        self,
        values: NDArray[Any],
        dtype: str = "f4",
        target: int | None = None,
        bounds: bool = False,
        normalized: bool = False,
    ) -> int:
        """Add values [n], [n, k] or [n, 4, 4], of which the format's matrices are transposed;
        return the accessor.

        bounds: state minimum and maximum, which positions and times of keys must.
        """
        array = np.ascontiguousarray(values, np.dtype(dtype).newbyteorder("<"))
        self._binary += bytes(-len(self._binary) % 4)
        view: Document = {
            "buffer": 0, "byteOffset": len(self._binary), "byteLength": array.nbytes
        }  # fmt: skip
        if target is not None:
            view["target"] = target
        self._binary += array.tobytes()
        entry: Document = {
            "bufferView": self.add("bufferViews", view),
            "componentType": _COMPONENTS[dtype],
            "count": len(array),
            "type": _TYPES[array.shape[1:]],
        }
        if normalized:
            entry["normalized"] = True
        if bounds:
            entry["min"] = np.atleast_1d(array.min(axis=0)).tolist()
            entry["max"] = np.atleast_1d(array.max(axis=0)).tolist()
        return self.add("accessors", entry)

    def content(self, suffix: str) -> bytes:
        """Return the bytes of a file of the suffix, .glb or .gltf."""
        document = dict(self.document)
        binary = bytes(self._binary) + bytes(-len(self._binary) % 4)
        if suffix.lower() == ".gltf":
            uri = _URI + base64.b64encode(binary).decode()
            document["buffers"] = [{"byteLength": len(binary), "uri": uri}]
            return json.dumps(document, ensure_ascii=False).encode()
        document["buffers"] = [{"byteLength": len(binary)}]
        text = json.dumps(document, ensure_ascii=False, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + len(binary)
        return b"".join((
            struct.pack("<4sII", b"glTF", 2, length),
            struct.pack("<I4s", len(text), b"JSON"), text,
            struct.pack("<I4s", len(binary), b"BIN\0"), binary,
        ))  # fmt: skip


def parsed(content: bytes, path: Path) -> tuple[Document, bytes]:
    """Return the JSON and the single buffer of a file. Raises ClipError, which names the path."""
    try:
        document, binary = gltf.document(content, path.suffix.lower())
        buffers = document.get("buffers", [])
        if len(buffers) > 1:
            raise ValueError(f"it has {len(buffers)} buffers: save it as .glb")
        uri = buffers[0].get("uri", "") if buffers else ""
        if uri.startswith("data:"):
            binary = base64.b64decode(uri.partition(",")[2])
        elif uri:
            raise ValueError(f"its buffer is another file ({uri[:80]}): save it as .glb")
    except (ValueError, KeyError, TypeError, AttributeError, struct.error) as error:
        raise ClipError(f"{path}: not a readable glTF file ({reason(error)})") from error
    return document, binary


def matrix(node: Document) -> NDArray[np.float64]:
    """Return the matrix [4, 4] of a node in its parent."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    found = np.eye(4)
    turn = Rotation.from_quat(node.get("rotation", (0.0, 0.0, 0.0, 1.0))).as_matrix()
    found[:3, :3] = turn * np.array(node.get("scale", (1.0, 1.0, 1.0)))
    found[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return found


def quaternions(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotations [T, 3, 3] as the format's quaternions [T, 4] x, y, z, w, without changes of
    sign from one to the next."""
    found = Rotation.from_matrix(matrices).as_quat()
    flips = np.sign(np.sum(found[1:] * found[:-1], axis=1))
    flips[flips == 0] = 1.0
    return found * np.concatenate(([1.0], np.cumprod(flips)))[:, None]
