"""What the page's viewer draws: shapes of a model, and poses in 16 bits."""

import base64

import mujoco
import numpy as np
import pytest

from console.evaluation.stepping import Track
from console.report import scene3d
from console.video import stage
from tests.support.console.recordings import take
from world.character import model as character
from world.furniture.catalogue import catalogue, find
from world.objects.furniture_bank import FurnitureBank
from world.scene.model import compile_scene


def test_visible_shapes_without_the_floor() -> None:
    piece = find("chair-train-000")
    model = compile_scene(piece)
    shapes, bodies = scene3d.shapes_of(model)
    furniture = bodies.index(model.body("furniture").id)
    boxes = [s for s in shapes if s["body"] == furniture]
    assert len(boxes) == len(piece.boxes) and {s["kind"] for s in boxes} == {"box"}
    assert boxes[0]["size"] == pytest.approx(piece.boxes[0].half_m, abs=1e-4)
    assert len(bodies) == 16 and all(s["kind"] != "plane" for s in shapes)
    assert boxes[0]["rgb"] == pytest.approx(model.geom_rgba[model.ngeom - 1][:3], abs=1e-4)


def test_furniture_and_character_have_the_colours_of_films() -> None:
    """As `stage`, whose model films are drawn from, has them."""
    piece = find("sofa-train-000")
    model = compile_scene(piece)
    film = stage.stage(model, piece.name)
    shapes, bodies = scene3d.shapes_of(model, piece.name)
    for number, body in enumerate(bodies):
        drawn = film.body(model.body(body).name).id
        rows = np.flatnonzero((film.geom_bodyid == drawn) & (film.geom_group <= stage.OBJECTS))
        mine = [shape for shape in shapes if shape["body"] == number]
        assert len(mine) == len(rows)
        for shape, row in zip(mine, rows, strict=True):
            assert shape["rgb"] == pytest.approx(film.geom_rgba[row][:3], abs=1e-4)
            assert shape["size"] == pytest.approx(film.geom_size[row], abs=1e-4)
            assert shape["pos"] == pytest.approx(film.geom_pos[row], abs=1e-4)


def test_collision_shapes_are_those_of_the_model() -> None:
    model = compile_scene(find("chair-train-000"))
    shapes, bodies = scene3d.shapes_of(model, look="shapes")
    own = [body for body in bodies if model.body(body).name in character.BODIES]
    found = [s for s in shapes if bodies[s["body"]] in own]
    assert len(found) == sum(int(model.body_geomnum[body]) for body in own)
    assert {s["kind"] for s in found} == {"sphere", "capsule", "box"}


def test_hulls_bring_their_corners_and_faces() -> None:
    spec = mujoco.MjSpec()
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    spec.add_mesh(name="m", uservert=corners.ravel())
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="m", rgba=[1, 1, 1, 1])
    ((shape,), _) = scene3d.shapes_of(spec.compile())
    assert len(shape["vertices"]) == 3 * 8 and len(shape["faces"]) == 3 * 12


def test_poses_come_back_to_half_a_millimetre() -> None:
    draw = np.random.default_rng(0)
    poses = np.concatenate((draw.uniform(-9, 9, (5, 3, 3)), draw.uniform(-1, 1, (5, 3, 4))), -1)
    poses[0, 0, 0] = 100.0
    whole = np.frombuffer(base64.b64decode(scene3d.packed(poses)), "<i2").reshape(5, 3, 7)
    back = np.concatenate((whole[..., :3] / 1000.0, whole[..., 3:] / 32767.0), -1)
    assert back[0, 0, 0] == pytest.approx(32.767), "farther than the page draws: clipped"
    np.testing.assert_allclose(back[1:, :, :3], poses[1:, :, :3], atol=5.1e-4)
    np.testing.assert_allclose(back[1:, :, 3:], poses[1:, :, 3:], atol=2e-5)


def track() -> Track:
    shown = take(6)
    shown.qpos[:, 0] = np.linspace(0, 1, 6)
    model = FurnitureBank([catalogue("test", 1)[0].scaled(1.1)]).models[0]
    return Track(shown, np.zeros((6, 114), np.float32), np.linspace(1, 0.5, 6), model, 6)


def test_the_viewer_gets_the_simulators_poses() -> None:
    shown = track()
    data = scene3d.drawable(shown)
    raw = np.frombuffer(base64.b64decode(data["poses"]), "<i2")
    poses = raw.reshape(6, data["bodies"], 7)
    model, state = shown.model, mujoco.MjData(shown.model)
    state.qpos[:] = shown.take.qpos[3]
    state.mocap_pos[0] = shown.take.mocap_pos[3]
    mujoco.mj_forward(model, state)
    for shape in data["shapes"]:
        assert shape["kind"] in ("ellipsoid", "capsule", "box")
    root = poses[3, data["root"]]
    assert root[:3] / 1000 == pytest.approx(state.xpos[1], abs=6e-4)
    assert root[3:] / 32767 == pytest.approx(state.xquat[1], abs=4e-5)
    # every visible geom stands where body pose and local pose put it
    furniture = model.body("furniture").id
    boxes = [shape for shape in data["shapes"] if shape["kind"] == "box"]
    geoms = [
        geom
        for geom in np.flatnonzero(model.geom_bodyid == furniture)
        if model.geom_rgba[geom][3] > 0.0
    ]
    assert len(boxes) == len(geoms) == len(shown.take.boxes)
    for shape, geom in zip(boxes, geoms, strict=True):
        at = poses[3, shape["body"]]
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, at[3:] / 32767)
        place = at[:3] / 1000 + rotation.reshape(3, 3) @ shape["pos"]
        assert place == pytest.approx(state.geom_xpos[geom], abs=2e-3)
