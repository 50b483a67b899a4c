"""Rigs of files: joints at rest, parts of the body by name or by a map, refusals in one line."""

import json
from pathlib import Path

import numpy as np
import pytest

from console.animation import rig
from console.animation.rig import RigError
from tests.support.console import rig_files


def test_a_bvh_at_rest(tmp_path: Path) -> None:
    path = rig_files.bvh(tmp_path / "r.bvh", "mixamo", order="XYZ")
    names, parents, place = rig_files.layout("mixamo")
    found = rig.read(path)
    kept = [j for j in range(len(found.names)) if j not in found.ends]
    assert tuple(found.names[j] for j in kept) == names
    np.testing.assert_allclose(found.position[kept], 100 * place, atol=1e-4)
    assert set(found.orders.values()) == {"xyz"} and len(found.ends) > 5 and len(parents) > 20


def test_a_bvh_needs_no_motion(tmp_path: Path) -> None:
    path = rig_files.bvh(tmp_path / "r.bvh", "mixamo")
    whole = rig.read(path)
    path.write_text(path.read_text().partition("MOTION")[0])
    assert rig.read(path).names == whole.names


@pytest.mark.parametrize("armature", [True, False])
def test_a_gltf_at_rest(tmp_path: Path, armature: bool) -> None:
    path = rig_files.glb(tmp_path / "r.glb", "mixamo", armature)
    names, _, place = rig_files.layout("mixamo")
    found = rig.read(path)
    columns = [found.names.index(name) for name in names]
    np.testing.assert_allclose(found.position[columns], place, atol=1e-6)
    assert found.scales is not None
    np.testing.assert_allclose(found.scales[columns], 0.01 if armature else 1.0, rtol=1e-6)
    # the mesh and its node are no joints
    assert len(found.names) == len(names) + armature
    turns = found.rotation @ np.swapaxes(found.rotation, 1, 2)
    np.testing.assert_allclose(turns, np.tile(np.eye(3), (len(turns), 1, 1)), atol=1e-6)


def test_a_map_names_what_names_do_not_say(tmp_path: Path) -> None:
    path = rig_files.bvh(tmp_path / "r.bvh", "mixamo")
    path.write_text(path.read_text().replace("mixamorig:LeftLeg", "Bone.012"))
    with pytest.raises(RigError) as caught:
        rig.read(path).parts(None)
    said = str(caught.value)
    assert said.startswith(f"--rig {path}: no joint found for left_knee") and "\n" not in said
    assert "Bone.012" in said and "--joint-map" in said
    given = tmp_path / "map.json"
    given.write_text(json.dumps({"left_knee": "Bone.012"}))
    found = rig.read(path)
    assert found.names[found.parts(given)["left_knee"]] == "Bone.012"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('{"left_knee": "nobody"}', "names 'nobody' as left_knee"),
        ('{"knee": "a"}', "unknown part 'knee'"),
        ("[", "not a readable map file"),
    ],
)
def test_a_wrong_map_is_one_line(tmp_path: Path, text: str, why: str) -> None:
    given = tmp_path / "map.json"
    given.write_text(text)
    with pytest.raises(RigError) as caught:
        rig.read(rig_files.bvh(tmp_path / "r.bvh", "mixamo")).parts(given)
    said = str(caught.value)
    assert why in said and "\n" not in said
    assert said.startswith(("--rig ", "--joint-map "))


def change(path: Path, **of_joint: object) -> None:
    """Change the node of the left leg of a .gltf."""
    document = json.loads(path.read_text())
    (node,) = [n for n in document["nodes"] if n["name"].endswith("LeftLeg")]
    node |= of_joint
    path.write_text(json.dumps(document))


@pytest.mark.parametrize(
    ("of_joint", "why"),
    [({"scale": [1, 2, 1]}, "scaled differently"), ({"scale": [-1, 1, 1]}, "mirrored")],
)
def test_what_cannot_be_turned_is_refused(tmp_path: Path, of_joint: dict, why: str) -> None:  # pyright: ignore
    path = rig_files.glb(tmp_path / "r.gltf", "mixamo")
    change(path, **of_joint)
    with pytest.raises(RigError, match=why) as caught:
        rig.read(path)
    assert str(caught.value).startswith(f"--rig {path}: ")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("r.fbx", b"x"), ("r.bvh", b""), ("r.bvh", b"HIERARCHY\nROOT a\n{"), ("r.glb", b"glTF"),
        ("r.gltf", b"{}"), ("r.gltf", b'{"nodes": 3}'),
        ("r.gltf", b'{"nodes": [{"children": [0]}]}'),
        ("r.gltf", b'{"skins": [{"joints": [7]}]}'), ("r.gltf", b'{"nodes": [{"matrix": [1]}]}'),
    ],
)  # fmt: skip
def test_damaged_rigs_are_one_line(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(RigError) as caught:
        rig.read(path).parts(None)
    said = str(caught.value)
    assert said.startswith(f"--rig {path}") and "\n" not in said, said


def test_a_chain_without_end_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "r.bvh"
    joints = "".join(f"JOINT j{k} {{ OFFSET 0 1 0 CHANNELS 0\n" for k in range(900))
    path.write_text(f"HIERARCHY ROOT r {{ OFFSET 0 0 0 CHANNELS 0\n{joints}{'}' * 901}\n")
    with pytest.raises(RigError, match="a chain of 900 joints is no person"):
        rig.read(path)


def test_a_rig_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(RigError, match="No such file"):
        rig.read(tmp_path / "r.bvh")
