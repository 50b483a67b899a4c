"""Furniture in the simulator: nothing floats, and what is dropped on the place stays there."""

import mujoco
import numpy as np
import pytest

from world.furniture.catalogue import catalogue
from world.furniture.piece import Piece

PIECES = catalogue("train") + catalogue("test")
RADIUS_M = 0.05


def compiled(piece: Piece, ball_m: tuple[float, float, float] | None = None) -> mujoco.MjModel:
    """Geom 0 the floor, then the piece's boxes; last, where asked for, a free ball."""
    spec = mujoco.MjSpec()
    spec.option.timestep = 1 / 120
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    spec.worldbody.add_geom(type=plane, size=[5.0, 5.0, 0.1])
    body = spec.worldbody.add_body()
    for box in piece.boxes:
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, pos=box.centre_m, size=box.half_m, quat=box.quat
        )
    if ball_m is not None:
        ball = spec.worldbody.add_body(pos=ball_m)
        ball.add_freejoint()
        # Rolling friction (m) far above r tan(4 deg) = 3.5 mm: little creep on the steepest seat.
        ball.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[RADIUS_M, 0.0, 0.0],
            mass=1.0,
            condim=6,
            friction=[1.0, 0.1, 0.1],
        )
    return spec.compile()


@pytest.mark.parametrize("piece", PIECES, ids=lambda p: p.name)
def test_every_box_is_carried_by_the_floor(piece: Piece):
    model = compiled(piece)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    count = model.ngeom
    touching = np.eye(count, dtype=bool)
    for a in range(count):
        for b in range(a):
            gap = mujoco.mj_geomDistance(model, data, a, b, 1.0, None)
            touching[a, b] = touching[b, a] = gap <= 0.005
    reached = np.zeros(count, dtype=bool)
    reached[0] = True
    for _ in range(count):
        reached = touching @ reached
    assert reached.all(), [i - 1 for i in np.flatnonzero(~reached)]
    # Nothing but the floor is under the piece: no corner lies below it.
    assert min(box.corners()[:, 2].min() for box in piece.boxes) > -1e-9


@pytest.mark.parametrize("scale", [0.8, 1.2])
@pytest.mark.parametrize("piece", PIECES, ids=lambda p: p.name)
def test_a_ball_comes_to_rest_on_the_place(piece: Piece, scale: float):
    scaled = piece.scaled(scale)
    x, y, z = scaled.sit[0].point_m
    model = compiled(scaled, (x, y, z + RADIUS_M + 0.05))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 240)
    assert np.linalg.norm(data.qvel[:3]) < 0.005
    assert abs(data.qpos[2] - RADIUS_M - z) < 0.005
    assert np.hypot(data.qpos[0] - x, data.qpos[1] - y) < 0.01


@pytest.mark.parametrize("piece", PIECES[::7], ids=lambda p: p.name)
def test_the_simulators_ray_meets_the_place(piece: Piece):
    model = compiled(piece)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    x, y, z = piece.sit[0].point_m
    geom = np.zeros(1, dtype=np.int32)
    down = np.array([0.0, 0.0, -1.0])
    distance = mujoco.mj_ray(model, data, np.array([x, y, 2.0]), down, None, 1, -1, geom)
    assert abs(2.0 - distance - z) < 1e-9
    assert geom[0] == 1
