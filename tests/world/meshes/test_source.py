"""Meshes as users have them: formats, axes, units, and a clear refusal of the rest."""

import json
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from tests.support.world.meshes import TRIANGLES, written, y_up
from world.errors import PieceError
from world.meshes import source
from world.meshes.frame import Frame
from world.meshes.upright import upright


@pytest.mark.parametrize("suffix", [".obj", ".stl", ".ply"])
def test_formats_with_z_up(tmp_path: Path, suffix: str) -> None:
    found = upright(source.read(written(tmp_path, suffix)), Frame())
    assert np.allclose(found, TRIANGLES, atol=1e-5)


def test_gltf_has_y_up_and_z_front(tmp_path: Path) -> None:
    found = upright(source.read(written(tmp_path, ".glb", y_up(TRIANGLES))), Frame())
    assert np.allclose(found, TRIANGLES, atol=1e-5)


def test_wrong_units_are_named() -> None:
    large = source.Source("chair", 100 * TRIANGLES.reshape(-1, 3), np.arange(len(TRIANGLES) * 3)
                          .reshape(-1, 3), ".obj")  # fmt: skip
    with pytest.raises(PieceError, match=r"is no furniture; give --unit cm") as refused:
        upright(large, Frame())
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("empty.obj", b"", "an empty file"),
        ("empty.stl", b"solid x\nendsolid x\n", "no triangles|not a readable"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangles|not a readable"),
        ("bad.glb", b"glTF" + bytes(40), "not a readable .glb"),
        ("bad.ply", b"ply\nnonsense", "not a readable .ply"),
        ("nan.obj", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "no numbers"),
        ("inf.obj", b"v inf 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "no numbers"),
        ("index.obj", b"v 0 0 0\nf 1 2 9\n", "triangles without their corners"),
    ],
)
def test_what_is_no_mesh_is_refused_in_one_line(name: str, content: bytes, says: str) -> None:
    with pytest.raises(PieceError, match=says) as refused:
        upright(source.parse(content, name), Frame())
    assert "\n" not in str(refused.value)
    assert name.split(".")[0] in str(refused.value)


def test_other_formats_name_those_that_are_read(tmp_path: Path) -> None:
    path = tmp_path / "chair.fbx"
    path.write_bytes(b"Kaydara")
    with pytest.raises(PieceError, match=r"\.glb.*\.sh3f"):
        source.read(path)


def test_two_million_triangles_are_refused_before_they_are_read() -> None:
    count = 2_000_000
    binary = bytes(80) + struct.pack("<I", count) + bytes(50 * count)
    tracemalloc.start()
    with pytest.raises(PieceError, match="2000000 triangles; decimate it"):
        source.parse(binary, "scan.stl")
    with pytest.raises(PieceError, match="2000000 triangles; decimate it"):
        source.parse(b"v 0 0 0\nv 1 0 0\nv 0 1 0" + b"\nf 1 2 3" * count, "scan.obj")
    with pytest.raises(PieceError, match="2000000 triangles"):
        source.parse(b"ply\nformat ascii 1.0\nelement face 2000000\nend_header\n", "scan.ply")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # no more than the file itself, once
    assert peak < 60e6


def test_a_scene_of_fifty_objects_is_refused() -> None:
    spots = [np.array([1.2 * (i % 10), 1.2 * (i // 10), 0.0]) for i in range(50)]
    rows = [TRIANGLES + spot for spot in spots]
    corners = np.concatenate(rows)
    scene = source.Source(
        "room", corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3), ".obj"
    )
    with pytest.raises(PieceError, match="room: a scene of 50 objects; export one piece a file"):
        upright(scene, Frame())


def test_a_gltf_that_names_files_elsewhere_is_refused(tmp_path: Path) -> None:
    (tmp_path / "secret.bin").write_bytes(bytes(36))
    folder = tmp_path / "in"
    folder.mkdir()
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "../secret.bin", "byteLength": 36}],
        "meshes": [],
    }
    (folder / "chair.gltf").write_text(json.dumps(document))
    with pytest.raises(PieceError, match="names a file outside its folder"):
        source.read(folder / "chair.gltf")


def test_comments_of_a_ply_are_passed_over(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """trimesh looks for the texture that a comment names, and prints a traceback without it."""
    path = written(tmp_path, ".ply")
    text = path.read_bytes().replace(b"ply\n", b"ply\ncomment TextureFile gone.png\n", 1)
    # exporters put comments after the format line
    first, second, rest = text.split(b"\n", 2)
    kind, body = rest.split(b"\n", 1)
    path.write_bytes(b"\n".join((first, kind, second, body)))
    assert np.allclose(upright(source.read(path), Frame()), TRIANGLES, atol=1e-5)
    assert capfd.readouterr() == ("", "")
