"""What the page's viewer draws: shapes of a model, and poses in 16 bits."""

import base64

import mujoco
import numpy as np
import pytest

from console.report import scene3d
from world.furniture.catalogue import find
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
