"""Containers of glTF: what is written is read by somebody else, what is damaged is refused."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from console.animation import gltf_file
from console.animation.gltf_file import Writer
from tests.support.console import gltf
from world.errors import ClipError


def small(suffix: str) -> bytes:
    writer = Writer()
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0.0]])
    where = writer.accessor(points, target=gltf_file.VERTICES, bounds=True)
    order = writer.accessor(np.array([0, 1, 2]), "u2", gltf_file.INDICES)
    writer.add("materials", {})
    primitive = {"attributes": {"POSITION": where}, "indices": order, "material": 0}
    writer.add("meshes", {"primitives": [primitive]})
    writer.add("nodes", {"name": "ä", "mesh": 0})
    writer.document |= {"scene": 0, "scenes": [{"nodes": [0]}]}
    return writer.content(suffix)


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_both_containers_hold_the_same(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(small(suffix))
    found = gltf.read(path)
    assert not found.issues and found.json["nodes"][0]["name"] == "ä"
    np.testing.assert_array_equal(found.values(0), [[0, 0, 0], [1, 0, 0], [0, 2, 0]])
    assert found.json["accessors"][0]["max"] == [1, 2, 0]
    np.testing.assert_array_equal(found.values(1)[:, 0], [0, 1, 2])
    document, binary = gltf_file.parsed(path.read_bytes(), path)
    assert document == found.json and binary == found.binary


def test_the_tests_own_reader_finds_what_is_wrong(tmp_path: Path) -> None:
    """A checker that finds nothing would pass everything."""
    document = json.loads(small(".gltf"))
    for change in (
        lambda d: d["accessors"][0].__setitem__("max", [9, 9, 9]),
        lambda d: d["accessors"][0].pop("min"),
        lambda d: d["bufferViews"][0].__setitem__("byteOffset", 2),
        lambda d: d["bufferViews"][1].__setitem__("byteLength", 10**6),
        lambda d: d["nodes"].append({"name": "lost"}),
        lambda d: d["nodes"][0].__setitem__("rotation", [1, 1, 0, 0]),
        lambda d: d["meshes"][0]["primitives"][0].__setitem__("material", 4),
    ):
        broken = json.loads(json.dumps(document))
        change(broken)
        path = tmp_path / "b.gltf"
        path.write_text(json.dumps(broken))
        assert gltf.read(path).issues


def test_a_node_has_the_matrix_of_its_parts() -> None:
    turn = Rotation.from_euler("xyz", [0.3, -0.4, 0.5])
    parts = {"translation": [1, 2, 3], "rotation": turn.as_quat().tolist(), "scale": [2, 3, 4]}
    found = gltf_file.matrix(parts)
    np.testing.assert_allclose(found @ (1, 0, 0, 1), [*(2 * turn.apply((1, 0, 0)) + (1, 2, 3)), 1])
    again = gltf_file.matrix({"matrix": found.T.reshape(-1).tolist()})
    np.testing.assert_allclose(again, found)


def test_quaternions_go_on_without_changing_sign() -> None:
    turns = Rotation.from_euler("z", np.linspace(0, 4 * np.pi, 50)[:, None])
    found = gltf_file.quaternions(turns.as_matrix())
    assert (np.sum(found[1:] * found[:-1], axis=1) > 0).all()
    assert (Rotation.from_quat(found) * turns.inv()).magnitude().max() < 1e-9


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"glTF\1\0\0\0\14\0\0\0", "version 1"),
        (b"{}x", "not a readable"),
        (b'{"buffers": [{"uri": "a.bin"}]}', "a.bin"),
        (b'{"buffers": [{}, {}]}', "2 buffers"),
        (b"[]", "no object"),
    ],
)
def test_damaged_files_are_one_line(content: bytes, why: str) -> None:
    path = Path("b.glb" if content.startswith(b"glTF") else "b.gltf")
    with pytest.raises(ClipError, match=why) as caught:
        gltf_file.parsed(content, path)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)
