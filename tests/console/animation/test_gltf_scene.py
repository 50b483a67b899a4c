"""glTF of scenes, read by the tests' own reader and by trimesh: joints, skin, objects, time."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from console.animation import body_mesh, gltf_scene
from console.animation.files import Animation, write
from console.animation.gltf_scene import About, Figure
from console.animation.skeleton import of_clip
from console.commands.animation import AnimationFlags
from console.recording import format as recording
from console.recording.clip import clip_of
from tests.support.console import gltf
from tests.support.console.motions import bodies, sits, walk, y_up
from tests.support.console.moving_takes import carried, followed, pushed
from world.character import model as character
from world.furniture.piece import Box


def written(path: Path, take: recording.Take, **flags: bool) -> gltf.File:
    clip = clip_of(take, "sit-chair", "a test", "CC0-1.0")
    write(path, Animation(clip, take, recording.model_of(take)), AnimationFlags(**flags))  # pyright: ignore
    return gltf.read(path)


@pytest.mark.parametrize("take", [pushed(), carried(), followed()])
@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
@pytest.mark.parametrize("root_motion", [False, True])
def test_it_keeps_the_rules_of_the_format(
    tmp_path: Path, take: recording.Take, suffix: str, root_motion: bool
) -> None:
    found = written(tmp_path / f"a{suffix}", take, root_motion=root_motion)
    assert found.issues == []
    assert found.json["asset"]["copyright"] == "CC0-1.0"
    assert found.json["asset"]["extras"]["source"] == "a test"


@pytest.mark.parametrize("root_motion", [False, True])
def test_joints_are_where_mujoco_has_the_bodies(tmp_path: Path, root_motion: bool) -> None:
    take = pushed()
    found = written(tmp_path / "a.glb", take, root_motion=root_motion)
    wanted = y_up(bodies(sits().part(0, len(take)))[0])
    columns = [found.node(body) for body in character.BODIES]
    np.testing.assert_allclose(found.times(), np.arange(len(take)) / 30.0, atol=1e-6)
    for frame in (0, 7, len(take) - 1):
        world = found.world(float(found.times()[frame]))
        np.testing.assert_allclose(world[columns, :3, 3], wanted[frame], atol=1e-5)
    if root_motion:
        root = found.world(0.5)[found.node("root")]
        assert abs(root[1, 3]) < 1e-9 and found.json["nodes"][found.node("root")]["children"]


def test_half_way_between_keys_it_is_half_way(tmp_path: Path) -> None:
    take = pushed()
    found = written(tmp_path / "a.glb", take)
    world = found.world(5.5 / 30.0)[found.node(take.piece)]
    wanted = 0.5 * (take.mocap_pos[5] + take.mocap_pos[6])
    np.testing.assert_allclose(world[:3, 3], y_up(wanted), atol=1e-5)


def test_before_the_animation_it_stands_in_a_t_pose(tmp_path: Path) -> None:
    found = written(tmp_path / "a.glb", pushed())
    world = found.world(None)
    columns = [found.node(body) for body in character.BODIES]
    turns = world[columns, :3, :3]
    np.testing.assert_allclose(turns, np.tile(np.eye(3), (15, 1, 1)), atol=1e-9)
    at = {body: world[found.node(body), :3, 3] for body in character.BODIES}
    assert at["left_hand"][0] > 0.7 and at["right_hand"][0] < -0.7, "+x is to the left"
    assert at["left_foot"][1] == pytest.approx(0.05, abs=1e-5) and at["head"][1] > 1.3


def test_the_skin_follows_each_body_rigidly_where_it_alone_moves_it(tmp_path: Path) -> None:
    """Skinned by the tests' reader; by hand from MuJoCo's poses of the bodies."""
    take = pushed()
    found = written(tmp_path / "a.glb", take)
    mesh = body_mesh.body_mesh()
    position, turns = body_mesh.pose()
    place, rotation = bodies(sits().part(0, len(take)))
    alone = np.flatnonzero(mesh.weights[:, 0] == 1.0)
    assert len(alone) > 100
    for frame in (0, 25):
        got = found.skinned("body", frame / 30.0)
        assert np.isfinite(got).all()
        body = mesh.bodies[alone, 0]
        own = np.einsum("nji,nj->ni", turns[body], mesh.vertices[alone] - position[body])
        wanted = place[frame][body] + np.einsum("nij,nj->ni", rotation[frame][body], own)
        np.testing.assert_allclose(got[alone], y_up(wanted), atol=2e-5)
        # the surface stays a person: nothing is torn, the feet are on the floor
        assert -0.06 < got[:, 1].min() < 0.05 and got[:, 1].max() < 1.8


def test_objects_move_as_in_the_take(tmp_path: Path) -> None:
    take = pushed()
    found = written(tmp_path / "a.glb", take)
    for frame in (0, 6, 29):
        world = found.world(frame / 30.0)
        chair = world[found.node(take.piece)]
        np.testing.assert_allclose(chair[:3, 3], y_up(take.mocap_pos[frame]), atol=1e-6)
        # its front, our +x, is glTF's +z
        front = Rotation.from_quat(take.mocap_quat[frame], scalar_first=True).apply((1, 0, 0))
        np.testing.assert_allclose(chair[:3, 2], y_up(front), atol=1e-6)
        late = world[found.node("projectile1")]
        size = np.linalg.norm(late[:3, 0])
        assert size == pytest.approx(1.0 if 5 <= frame < 20 else 0.0, abs=1e-6)


def test_a_box_and_its_stands(tmp_path: Path) -> None:
    take = carried()
    found = written(tmp_path / "a.glb", take)
    moved = {channel["target"]["node"] for channel in found.json["animations"][0]["channels"]}
    for frame in (0, 29):
        box = found.world(frame / 30.0)[found.node("box")]
        np.testing.assert_allclose(box[:3, 3], y_up(take.qpos[frame, 43:46]), atol=1e-6)
    assert found.node("box") in moved
    assert not {found.node("first_stand"), found.node("target_stand")} & moved


def test_a_reference_is_a_second_figure_that_can_be_seen_through(tmp_path: Path) -> None:
    take = followed()
    found = written(tmp_path / "a.glb", take)
    world = found.world(0.2)
    own, other = world[found.node("pelvis")], world[found.node("reference_pelvis")]
    np.testing.assert_allclose(other[:3, 3] - own[:3, 3], (0, 0, 0.5), atol=1e-5)
    mesh = found.json["meshes"][found.json["nodes"][found.node("reference")]["mesh"]]
    material = found.json["materials"][mesh["primitives"][0]["material"]]
    assert material["alphaMode"] == "BLEND"
    assert material["pbrMetallicRoughness"]["baseColorFactor"][3] == 0.4
    # both share one surface in the file
    body = found.json["meshes"][found.json["nodes"][found.node("body")]["mesh"]]
    assert body["primitives"][0]["attributes"] == mesh["primitives"][0]["attributes"]


def test_trimesh_reads_the_same_scene(tmp_path: Path) -> None:
    take = pushed()
    path = tmp_path / "a.glb"
    written(path, take)
    scene = trimesh.load_scene(path)
    names = {name for name in scene.graph.nodes if name in (take.piece, "pelvis", "head")}
    assert names == {take.piece, "pelvis", "head"}
    # the chair's size, in glTF's axes, at its first place
    low, high = scene.bounds
    parts = [g for name, g in scene.geometry.items() if name.startswith(take.piece)]
    extent = trimesh.util.concatenate(parts).extents
    boxes = (Box(tuple(r[:3]), tuple(r[3:6]), tuple(r[6:])) for r in take.boxes)
    corners = np.concatenate([box.corners() for box in boxes])
    np.testing.assert_allclose(extent, y_up(np.ptp(corners, axis=0)), atol=1e-5)
    assert high[1] > 1.6 and low[1] > -0.1


def test_colours_are_linear() -> None:
    """sRGB 0.5 is 0.214 of the light (IEC 61966-2-1)."""
    content = gltf_scene.content([Figure(of_clip(walk(), "t-pose"))], [], 30.0,
                                 About("a", "b", "c"), ".gltf")  # fmt: skip
    colours = {
        m["name"]: m["pbrMetallicRoughness"]["baseColorFactor"]
        for m in json.loads(content)["materials"]
    }
    assert set(colours) == {"skin", "shirt", "trousers", "shoes"}
    # skin: 0.82, 0.66, 0.56
    np.testing.assert_allclose(colours["skin"], (0.638, 0.393, 0.274, 1), atol=2e-3)
