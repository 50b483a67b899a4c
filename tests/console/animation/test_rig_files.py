"""Files of motions on rigs, read back by pybvh and by the tests' own glTF reader."""

import json
from pathlib import Path

import numpy as np
import pybvh
import pytest

from console.animation import rig, rig_files
from console.animation.retarget import onto
from console.animation.rig import RigError
from tests.support.console import gltf
from tests.support.console import rig_files as made
from tests.support.console.motions import sits, walk
from world.motions.formats import bvh as reader
from world.motions.formats import landmarks
from world.motions.retarget.convert import retargeted


def positions(path: Path) -> tuple[tuple[str, ...], np.ndarray]:
    """Joint names and positions [T, J, 3] of the motion on a rig, in its file's world."""
    found = rig.read(path)
    return found.names, onto(sits(), found, found.parts(None)).skeleton.world[0]


#: Other readers take no names with spaces, as "Bip01 Pelvis".
KINDS = ("mixamo", "3ds max biped with underlines", "daz genesis 8", "unreal mannequin")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", ["ZXY", "XYZ", "YZX"])
def test_a_bvh_has_the_rigs_own_hierarchy(tmp_path: Path, kind: str, order: str) -> None:
    path, out = made.bvh(tmp_path / "r.bvh", kind, order=order), tmp_path / "o.bvh"
    out.write_bytes(rig_files.content(sits(), ".bvh", path, None))
    names, wanted = positions(path)
    read = pybvh.read_bvh_file(out)
    assert list(read.joint_names) == [n for n in names if not n.endswith("_end")]
    columns = [names.index(name) for name in read.joint_names]
    np.testing.assert_allclose(read.joint_positions(), wanted[:, columns], atol=1e-3)
    text = out.read_text()
    axes = " ".join(f"{axis}rotation" for axis in order)
    assert text.count(f"CHANNELS 3 {axes}") == len(read.joint_names) - 1
    # bones and ends of the rig are kept as they were
    offsets = [[line.split() for line in p.read_text().splitlines() if "OFFSET" in line]
               for p in (path, out)]  # fmt: skip
    np.testing.assert_allclose(*[np.array([o[1:] for o in f[1:]], float) for f in offsets],
                               atol=1e-5)  # fmt: skip


def test_the_import_of_the_export_is_the_motion(tmp_path: Path) -> None:
    """Through another's skeleton and back, by the rules of names in both directions."""
    path, out = made.bvh(tmp_path / "r.bvh", "mixamo"), tmp_path / "o.bvh"
    out.write_bytes(rig_files.content(walk(), ".bvh", path, None))
    again = retargeted(reader.read(out))
    assert again.frames == walk().frames
    # which way it heads is the importer's own business: files with y up have no heading
    paths = [clip.root_position_m - clip.root_position_m[0] for clip in (again, walk())]
    lengths = [np.linalg.norm(path[:, :2], axis=1) for path in paths]
    assert lengths[1].max() > 0.5, "it walks"
    np.testing.assert_allclose(*lengths, atol=0.03)
    np.testing.assert_allclose(again.root_position_m[:, 2], walk().root_position_m[:, 2], atol=0.02)


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
@pytest.mark.parametrize("armature", [True, False])
def test_a_gltf_keeps_its_mesh_and_moves(tmp_path: Path, suffix: str, armature: bool) -> None:
    path, out = made.glb(tmp_path / f"r{suffix}", "mixamo", armature), tmp_path / f"o{suffix}"
    out.write_bytes(rig_files.content(sits(), suffix, path, None))
    names, wanted = positions(path)
    before, found = gltf.read(path), gltf.read(out)
    assert found.issues == [] and len(found.json["animations"]) == 1
    for kept in ("meshes", "skins", "materials"):
        assert found.json[kept] == before.json[kept]
    np.testing.assert_array_equal(
        found.values(found.json["skins"][0]["inverseBindMatrices"]),
        before.values(before.json["skins"][0]["inverseBindMatrices"]),
    )
    for frame in (0, len(wanted) - 1):
        world = found.world(float(found.times()[frame]))
        for joint, name in enumerate(names):
            if name == "Armature":
                continue  # it stays where it is, the hips travel
            np.testing.assert_allclose(world[found.node(name), :3, 3], wanted[frame, joint],
                                       atol=1e-4)  # fmt: skip
            # the armature's scale stays
            size = np.linalg.norm(world[found.node(name), :3, 0])
            assert size == pytest.approx(0.01 if armature else 1.0, rel=1e-4)
    # skinned by the tests' reader: the mesh comes along with the hips, which alone move it
    at = found.skinned("hero", 0.0)
    rest = before.skinned("hero", None)
    assert np.isfinite(at).all()
    np.testing.assert_allclose(np.linalg.norm(at[1] - at[0]), np.linalg.norm(rest[1] - rest[0]),
                               rtol=1e-4)  # fmt: skip


def test_the_same_rig_in_both_formats_moves_alike(tmp_path: Path) -> None:
    """In BVH all axes are the world's at rest, in the glTF each joint has its own."""
    first, one = positions(made.bvh(tmp_path / "r.bvh", "mixamo", unit=1.0))
    second, other = positions(made.glb(tmp_path / "r.glb", "mixamo"))
    for name in first:
        if not name.endswith("_end"):
            np.testing.assert_allclose(
                one[:, first.index(name)], other[:, second.index(name)], atol=2e-5
            )


def test_a_gltf_rig_gives_a_bvh_too(tmp_path: Path) -> None:
    path, out = made.glb(tmp_path / "r.glb", "mixamo", False), tmp_path / "o.bvh"
    out.write_bytes(rig_files.content(sits(), ".bvh", path, None))
    names, wanted = positions(path)
    read = pybvh.read_bvh_file(out)
    columns = [names.index(name) for name in read.joint_names]
    np.testing.assert_allclose(read.joint_positions(), wanted[:, columns], atol=1e-4)


def test_a_map_is_followed(tmp_path: Path) -> None:
    path = made.bvh(tmp_path / "r.bvh", "mixamo")
    plain = rig_files.content(sits(), ".bvh", path, None)
    strange = tmp_path / "s.bvh"
    strange.write_text(path.read_text().replace("mixamorig:LeftLeg", "Bone.012"))
    given = tmp_path / "map.json"
    given.write_text(json.dumps({"left_knee": "Bone.012"}))
    mapped = rig_files.content(sits(), ".bvh", strange, given)
    assert mapped == plain.replace(b"mixamorig:LeftLeg", b"Bone.012")
    assert "left_knee" in landmarks.ROLES


def test_a_bvh_rig_gives_no_gltf(tmp_path: Path) -> None:
    path = made.bvh(tmp_path / "r.bvh", "mixamo")
    with pytest.raises(RigError, match=r"gives \.bvh files; for \.glb"):
        rig_files.content(sits(), ".glb", path, None)
