"""Meshes as users have them: formats, axes, units, libraries, and a clear refusal of the rest."""

import io
import json
import struct
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from world.errors import ChoiceError, ConfigError, PieceError
from world.furniture.catalogue import find
from world.furniture.piece import Box, Piece, Place
from world.furniture.surface import triangles
from world.meshes import decompose, source, store, sweethome
from world.meshes.build import Built, Told, build, located
from world.meshes.classes import named, settled
from world.meshes.upright import Frame, upright

CHAIR = find("chair-train-000")
TRIANGLES = triangles(CHAIR)


def mesh(corners: np.ndarray = TRIANGLES) -> trimesh.Trimesh:
    """The chair as trimesh has it, nothing merged: metres, z up, +x front."""
    return trimesh.Trimesh(
        corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3), process=False
    )


def written(folder: Path, suffix: str, corners: np.ndarray = TRIANGLES) -> Path:
    path = folder / f"chair{suffix}"
    path.write_bytes(_bytes(mesh(corners).export(file_type=suffix[1:])))
    return path


def _bytes(content: object) -> bytes:
    return content.encode() if isinstance(content, str) else bytes(content)  # pyright: ignore[reportArgumentType]


def y_up(corners: np.ndarray) -> np.ndarray:
    """From z up, +x front to y up, +z front."""
    return corners[..., [1, 2, 0]]


@pytest.mark.parametrize("suffix", [".obj", ".stl", ".ply"])
def test_formats_with_z_up(tmp_path: Path, suffix: str) -> None:
    found = upright(source.read(written(tmp_path, suffix)), Frame())
    assert np.allclose(found, TRIANGLES, atol=1e-5)


def test_gltf_has_y_up_and_z_front(tmp_path: Path) -> None:
    found = upright(source.read(written(tmp_path, ".glb", y_up(TRIANGLES))), Frame())
    assert np.allclose(found, TRIANGLES, atol=1e-5)


def test_axes_units_and_height(tmp_path: Path) -> None:
    turned = source.read(written(tmp_path, ".obj", 100 * y_up(TRIANGLES)))
    frame = Frame(up="+y", front="+z", unit="cm")
    assert np.allclose(upright(turned, frame), TRIANGLES, atol=1e-5)
    tall = upright(turned, Frame("+y", "+z", height_m=1.0))
    assert np.allclose(tall, TRIANGLES / CHAIR.size_m[2], atol=1e-5)
    backwards = upright(turned, Frame("+y", "-z", "cm"))
    assert np.allclose(backwards[..., 0], -TRIANGLES[..., 0], atol=1e-5)
    with pytest.raises(ConfigError, match="two different axes"):
        upright(turned, Frame(up="+y", front="-y"))


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
        ("index.obj", b"v 0 0 0\nf 1 2 9\n", "not a readable|no triangles"),
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
    with pytest.raises(ChoiceError, match=r"\.glb.*\.sh3f"):
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


def library(entries: dict[str, bytes], catalogue: str | None = None) -> bytes:
    """A .sh3f."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        if catalogue is not None:
            archive.writestr(sweethome.CATALOGUE, catalogue)
        for name, content in entries.items():
            archive.writestr(name, content)
    return stream.getvalue()


CATALOGUE = """# a comment
provider=The library
license=CC0
id#1=a
name#1=Kitchen chair
category#1=Seats
model#1=/models/chair.obj
width#1=45
depth#1=50
height#1=90
modelRotation#1=1 0 0 0 1 0 0 0 1
creator#1=Ada \\
  Lovelace
name#2=Bar stool
model#2=/models/nothing.obj
width#2=40
depth#2=40
height#2=75
name#3=Lamp
model#3=/models/chair.obj
width#3=40
depth#3=40
height#3=75
name#4=Wrong table
model#4=/../../etc/table.obj
width#4=40
depth#4=40
height#4=75
name#5=Sofa
model#5=/models/chair.obj
width#5=wide
depth#5=40
height#5=75
"""


def test_a_sweet_home_library(tmp_path: Path) -> None:
    path = tmp_path / "mine.sh3f"
    content = _bytes(mesh(y_up(TRIANGLES)).export(file_type="obj"))
    path.write_bytes(library({"models/chair.obj": content}, CATALOGUE))
    found = {e.title: e for e in sweethome.entries(path)}
    chair = found["Kitchen chair"]
    assert (chair.licence, chair.credit) == ("CC0", "Ada Lovelace")
    corners = upright(sweethome.source(chair), chair.frame)
    assert np.allclose(np.ptp(corners.reshape(-1, 3), axis=0), (0.50, 0.45, 0.90), atol=1e-6)
    # the same chair, stretched to its catalogued size
    stretch = np.array((0.50, 0.45, 0.90)) / CHAIR.size_m
    assert np.allclose(corners, TRIANGLES * stretch, atol=1e-4)
    assert "not in the library" in found["Bar stool"].refused
    assert "outside the library" in found["Wrong table"].refused
    assert found["Sofa"].refused


def test_a_path_outside_the_folder_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "evil.sh3f"
    path.write_bytes(library({"../../evil.obj": b"v 0 0 0"}, CATALOGUE))
    with pytest.raises(PieceError, match=r"a path outside the library: \.\./\.\./evil\.obj"):
        list(sweethome.entries(path))


def test_a_zip_bomb_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.sh3f"
    zeros = bytes(sweethome.MAX_ENTRY_BYTES + 1)
    path.write_bytes(library({"models/chair.obj": zeros}, CATALOGUE))
    (chair, *_) = sweethome.entries(path)
    assert "MB unpacked" in chair.refused
    assert chair.content == b""
    many = library({f"{i}.obj": b"" for i in range(sweethome.MAX_ENTRIES + 1)}, CATALOGUE)
    path.write_bytes(many)
    with pytest.raises(PieceError, match="at most 20000"):
        list(sweethome.entries(path))


def test_what_is_no_library_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.sh3f"
    for content, says in (
        (b"no zip", "not a .sh3f library"),
        (library({"a.obj": b""}), "no PluginFurnitureCatalog"),
        (library({}, "provider=x"), "names no furniture"),
    ):
        path.write_bytes(content)
        with pytest.raises(PieceError, match=says):
            list(sweethome.entries(path))


def test_a_box_by_hand_has_its_mass_and_inertia() -> None:
    x, y, z = 0.4, 0.6, 1.0
    corners = np.array([[i * x, j * y, k * z] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    hull = decompose.closed(corners)
    assert hull is not None
    assert len(hull.faces) == 12
    mass, centre, inertia = decompose.mass_properties((hull,), 100.0)
    assert mass == pytest.approx(24.0)
    assert np.allclose(centre, (0.2, 0.3, 0.5))
    expected = 24.0 / 12 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
    assert np.allclose(inertia, np.diag(expected))
    box = decompose.around(hull)
    assert np.allclose(sorted(box.half_m), (0.2, 0.3, 0.5))


def test_two_hulls_by_trimesh() -> None:
    a = trimesh.creation.icosphere(2, 0.2)
    b = trimesh.creation.box((0.3, 0.2, 0.5))
    a.apply_translation((0.1, 0.7, 0.2))
    hulls = tuple(h for m in (a, b) if (h := decompose.closed(np.asarray(m.vertices))) is not None)
    mass, centre, inertia = decompose.mass_properties(hulls, 50.0)
    both = trimesh.util.concatenate([a.convex_hull, b.convex_hull])
    assert mass == pytest.approx(50.0 * both.volume, rel=1e-6)
    assert np.allclose(centre, both.center_mass, atol=1e-6)
    assert np.allclose(inertia, 50.0 * both.moment_inertia, rtol=1e-5, atol=1e-6)


def test_a_sheet_gets_a_thickness_and_a_hull_is_cut_level() -> None:
    flat = np.array([[0, 0, 0.0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    sheet = decompose.closed(flat)
    assert sheet is not None
    assert np.ptp(np.array(sheet.vertices_m), axis=0)[2] == pytest.approx(decompose.THINNEST_M)
    roof = decompose.closed(np.concatenate((flat, [[0.5, 0.5, 0.1]])))
    assert roof is not None
    lower = decompose.lowered(roof, 0.06)
    assert lower is not None
    assert np.array(lower.vertices_m)[:, 2].max() == pytest.approx(0.06)
    # a pyramid of volume 1/3 * 0.1 less its tip, which is (0.4)^3 of it
    mass, _, _ = decompose.mass_properties((lower,), 1.0)
    assert mass == pytest.approx(0.1 / 3 * (1 - 0.4**3))
    assert decompose.lowered(roof, 0.2) is roof


def test_classes_by_name_and_shape() -> None:
    assert named("Scopia armchair") == "armchair"
    assert named("bar_stool") == "high-stool"
    assert named("coffee-table") == "table"
    assert named("lamp") is None
    seat = (Place((0.0, 0.0, 0.7)),)
    assert settled("stool", (0.4, 0.4, 0.7), seat, None) == "high-stool"
    assert settled(None, (0.5, 0.45, 0.9), (Place((0.0, 0.0, 0.45)),), None) == "chair"
    assert settled(None, (1.0, 1.5, 0.74), (), None) == "table"


def built(sit: tuple[float, float, float, float] | None = None) -> Built:
    """The chair from its own boxes as hulls, cut by no decomposition."""
    parts = tuple(h for b in CHAIR.boxes if (h := decompose.closed(b.corners())) is not None)
    piece, error = located("mine", TRIANGLES, parts, Told(category="chair", sit=sit))
    return Built(piece, np.zeros(3), np.eye(3), error)


def test_places_are_found_and_can_be_told() -> None:
    found = built().piece
    assert found.sit[0].point_m[2] == pytest.approx(CHAIR.sit[0].point_m[2], abs=0.02)
    told = built((0.1, 0.0, 0.5, 90.0)).piece
    assert told.sit[0].point_m == (0.1, 0.0, 0.5)
    assert told.sit[0].facing_rad == pytest.approx(np.pi / 2)


def test_places_in_which_hulls_stand_are_left_out() -> None:
    """A bench for three, whose hulls are broader than the mesh at one end: a hull spans hollows."""
    bench = (Box((0.0, 0.0, 0.43), (0.25, 0.9, 0.02)), Box((-0.24, 0.0, 0.7), (0.01, 0.9, 0.25)))
    filled = Box((0.0, 0.6, 0.55), (0.25, 0.29, 0.1))
    surface = triangles(Piece("bench", "sofa", bench, (), 20.0))

    def places(boxes: tuple[Box, ...]) -> list[float]:
        parts = tuple(h for b in boxes if (h := decompose.closed(b.corners())) is not None)
        piece, _ = located("bench", surface, parts, Told(category="sofa"))
        assert all(p.point_m[2] == pytest.approx(0.45, abs=0.01) for p in piece.sit)
        return sorted(p.point_m[1] for p in piece.sit)

    free = places(bench)
    assert len(free) == 3
    assert places((*bench, filled)) == pytest.approx(free[:2], abs=0.02)


def test_a_piece_without_a_seat_is_refused() -> None:
    spike = np.array([[[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0.9]]], dtype=np.float64)
    hull = decompose.closed(np.concatenate((spike[0], spike[0] + [0.05, 0.05, 0.0])))
    assert hull is not None
    with pytest.raises(PieceError, match=r"no place to sit on this chair .*--sit"):
        located("spike", spike, (hull,), Told(category="chair"))


def test_pieces_survive_the_file(tmp_path: Path) -> None:
    content = store.document(built(), "0" * 64, "chair.obj")
    path = tmp_path / f"mine{store.SUFFIX}"
    store.write(path, content)
    (back,) = store.pieces(tmp_path)
    again = store.read(path)
    assert back == again
    assert np.allclose(back.size_m, built().piece.size_m, atol=1e-6)
    assert not list(tmp_path.glob("*.part"))
    for broken, says in (
        ("[]", "not a piece"),
        ("{", "damaged"),
        (json.dumps(content | {"version": 9}), "this reads 1"),
        (json.dumps({k: v for k, v in content.items() if k != "hulls"}), "damaged"),
        (json.dumps(content | {"sit": [{"point_m": [0, 0, float("nan")], "facing_rad": 0}]}),
         "damaged"),
    ):  # fmt: skip
        path.write_text(broken)
        with pytest.raises(PieceError, match=says):
            store.read(path)


def test_a_decomposition_covers_the_chair() -> None:
    made = build(source.Source("mine", TRIANGLES.reshape(-1, 3),
                               np.arange(len(TRIANGLES) * 3).reshape(-1, 3), ".obj"),
                 Told(category="chair"))  # fmt: skip
    assert 4 <= len(made.piece.hulls) <= 16
    assert all(len(h.vertices_m) <= 48 for h in made.piece.hulls)
    assert np.allclose(made.piece.size_m, CHAIR.size_m, atol=0.02)
    assert made.seat_error_m == pytest.approx(0.0, abs=0.02)
    assert 0.5 < made.piece.mass_kg < 20.0
    assert np.linalg.eigvalsh(made.inertia_kg_m2).min() > 0.0
