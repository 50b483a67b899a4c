"""glTF geometry as exporters and optimisers write it."""

import base64
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from world.errors import PieceError
from world.meshes import source
from world.meshes.formats import gltf

#: A tetrahedron, whose corners have the extent 0.5, 1 and 0.25 m.
CORNERS = np.array([[0, 0, 0], [0.5, 0, 0], [0, 1, 0], [0, 0, 0.25]])
FACES = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
Change = Callable[[dict[str, Any]], None]


def content(kind: str = "f4", normalized: bool = False) -> tuple[dict[str, Any], bytes]:
    """A document and its buffer; integers fill their range, and the node scales them back."""
    node: dict[str, Any] = {"mesh": 0}
    extent = CORNERS.max(axis=0)
    if kind == "f4":
        stored = CORNERS.astype("<f4")
    else:
        most = np.iinfo(kind).max
        stored = np.round(CORNERS / extent * most).astype("<" + kind)
        node["scale"] = (extent / (1 if normalized else most)).tolist()
    row = stored.itemsize * 3
    stride = row + -row % 4
    points = b"".join(p.tobytes().ljust(stride, b"\0") for p in stored)
    indices = np.array(FACES, dtype="<u2").tobytes()
    code = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "f4": 5126}[kind]
    document = {
        "asset": {"version": "2.0", "copyright": "Ada"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": code, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(points), "byteStride": stride},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(indices)},
        ],
        "buffers": [{"byteLength": len(points) + len(indices)}],
    }
    if normalized:
        document["accessors"][0]["normalized"] = True
    return document, points + indices


def glb(document: dict[str, Any], buffer: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def triangles(data: bytes, suffix: str = ".glb", folder: Path | None = None) -> np.ndarray:
    vertices, faces, credit = gltf.read(data, f"a{suffix}", suffix, folder)
    assert credit == "Ada"
    return vertices[faces]


@pytest.mark.parametrize(
    ("kind", "normalized"),
    [("f4", False), *((kind, way) for kind in ("i1", "u1", "i2", "u2") for way in (False, True))],
)
def test_quantised_positions_have_their_size(kind: str, normalized: bool) -> None:
    found = triangles(glb(*content(kind, normalized)))
    assert np.allclose(found, CORNERS[FACES], atol=1e-6)


@pytest.mark.parametrize(
    ("uri", "name"),
    [
        ("my%20chair.bin", "my chair.bin"),
        ("m%C3%B6bel%20%231.bin", "möbel #1.bin"),
        ("parts/x%20y.bin", "parts/x y.bin"),
        ("a b+c.bin", "a b+c.bin"),
        ("100%25.bin", "100%.bin"),
        ("50%.bin", "50%.bin"),
    ],
)
def test_uris_are_decoded(uri: str, name: str, tmp_path: Path) -> None:
    document, buffer = content()
    document["buffers"][0]["uri"] = uri
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_bytes(buffer)
    found = triangles(json.dumps(document).encode(), ".gltf", tmp_path)
    assert np.allclose(found, CORNERS[FACES])


def test_a_buffer_within_the_file_is_read() -> None:
    document, buffer = content()
    document["buffers"][0]["uri"] = "data:;base64," + base64.b64encode(buffer).decode()
    assert np.allclose(triangles(json.dumps(document).encode(), ".gltf"), CORNERS[FACES])


@pytest.mark.parametrize(
    "uri", ["../a.bin", "%2e%2e/a.bin", "..%5Ca.bin", "/etc/hostname", "http://x.org/a", "c:/a"]
)
def test_a_buffer_outside_the_folder_is_refused(uri: str, tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    (tmp_path / "a.bin").write_bytes(content()[1])
    document, _ = content()
    document["buffers"][0]["uri"] = uri
    with pytest.raises(PieceError, match=r"a\.gltf: it names a file outside its folder"):
        triangles(json.dumps(document).encode(), ".gltf", folder)


def test_nodes_are_placed_by_their_parents() -> None:
    """A quarter turn about y, then 1 m along x: (x, y, z) becomes (z + 1, y, -x)."""
    document, buffer = content()
    half = np.sqrt(0.5)
    document["nodes"] = [
        {"translation": [1, 0, 0], "children": [1]},
        {"rotation": [0, half, 0, half], "children": [2]},
        {"mesh": 0, "matrix": np.eye(4).ravel().tolist()},
    ]
    expected = CORNERS[:, [2, 1, 0]] * [1, 1, -1] + [1, 0, 0]
    assert np.allclose(triangles(glb(document, buffer)), expected[FACES])
    del document["scene"], document["scenes"]
    assert np.allclose(triangles(glb(document, buffer)), expected[FACES])


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        (5, [[0, 1, 2], [2, 1, 3]]),
        (6, [[0, 1, 2], [0, 2, 3]]),
        (1, np.zeros((0, 3))),  # lines
    ],
)
def test_strips_and_fans_are_triangles(mode: int, expected: list[list[int]]) -> None:
    document, buffer = content()
    document["accessors"][1]["count"] = 4
    document["meshes"][0]["primitives"][0]["mode"] = mode
    indices = np.array([0, 1, 2, 3], dtype="<u2").tobytes()
    data = glb(document, buffer[:48] + indices.ljust(24, b"\0"))
    _, faces, _ = gltf.read(data, "a.glb", ".glb", None)
    assert faces.tolist() == np.array(expected).astype(int).tolist()


def test_a_mirrored_node_keeps_its_faces_outwards() -> None:
    document, buffer = content()
    document["nodes"][0]["scale"] = [-1, 1, 1]
    found = triangles(glb(document, buffer))
    assert np.allclose(found, (CORNERS * [-1, 1, 1])[FACES][:, ::-1])


def _draco(document: dict[str, Any]) -> None:
    extension = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    document["meshes"][0]["primitives"][0]["extensions"] = extension
    for accessor in document["accessors"]:
        del accessor["bufferView"]
    document["extensionsRequired"] = list(extension)


def _meshopt(document: dict[str, Any]) -> None:
    document["bufferViews"][0] |= {"buffer": 1, "extensions": {"EXT_meshopt_compression": {}}}
    document["buffers"].append({"byteLength": 48})


def _cycle(document: dict[str, Any]) -> None:
    document["nodes"][0]["children"] = [0]


def _other(document: dict[str, Any]) -> None:
    document["extensionsRequired"] = ["KHR_materials_unlit", "EXT_mesh_gpu_instancing"]


def _missing(document: dict[str, Any]) -> None:
    document["buffers"][0]["uri"] = "gone%20.bin"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (_draco, r"compressed with Draco .*export it without compression, or decompress it"),
        (_meshopt, r"compressed with meshopt .*export it without compression"),
        (_cycle, r"its nodes are no tree"),
        (_other, r"requires the extension EXT_mesh_gpu_instancing, which is not read"),
        (_missing, r"its geometry is in gone \.bin, which is not beside it; put that file"),
    ],
)
def test_what_is_not_read_is_named_with_what_to_do(change: Change, says: str) -> None:
    document, buffer = content()
    change(document)
    with pytest.raises(PieceError, match=rf"^a\.glb: .*{says}") as refused:
        triangles(glb(document, buffer))
    assert "\n" not in str(refused.value)


def test_an_optional_compression_with_plain_data_is_read() -> None:
    document, buffer = content()
    extension = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    document["meshes"][0]["primitives"][0]["extensions"] = extension
    assert np.allclose(triangles(glb(document, buffer)), CORNERS[FACES])


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("accessors", 0, "count"), 10**9),
        (("accessors", 0, "count"), -1),
        (("accessors", 0, "byteOffset"), 40),
        (("accessors", 1, "componentType"), 7),
        (("bufferViews", 1, "byteLength"), 10**12),
        (("bufferViews", 0, "byteStride"), 1),
        (("buffers", 0), 5),
        (("nodes", 0, "mesh"), 3),
        (("scenes", 0, "nodes"), [7]),
    ],
)
def test_damage_is_a_refusal(path: tuple[Any, ...], value: Any) -> None:
    document, buffer = content()
    place: Any = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(PieceError, match=r"^a\.glb: "):
        source.parse(glb(document, buffer), "a.glb")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d.pop("accessors"), "'accessors' is missing"),
        (lambda d: d["accessors"][0].pop("componentType"), "'componentType' is missing"),
        (lambda d: d["nodes"][0].update(mesh=7), "a number that points beyond its list"),
        (lambda d: d.update(nodes={"a": 1}), "is missing"),
        (lambda d: d["meshes"][0].update(primitives=3), "a value of another kind than the form"),
        (lambda d: d["accessors"][0].update(count="four"), "'four' is no whole number"),
    ],
)
def test_a_damaged_document_is_said_in_words_of_the_file(change: Change, said: str) -> None:
    document, buffer = content()
    change(document)
    with pytest.raises(PieceError) as caught:
        source.parse(glb(document, buffer), "a.glb")
    text = str(caught.value)
    assert text.startswith("a.glb: not a readable .glb file (") and said in text
    assert not any(word in text for word in ("object", "list index", "argument", "Error"))
