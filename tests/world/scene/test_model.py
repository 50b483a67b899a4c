"""Models of scenes: one layout for all pieces, parked slots, and what meets what."""

import mujoco
import numpy as np
import pytest

from world.character import model as character
from world.furniture.catalogue import find
from world.furniture.piece import Piece
from world.scene import box as box_scene
from world.scene import slots
from world.scene.model import Ball, compile_room, compile_scene

CHAIR, BED = find("chair-train-000"), find("bed-train-000")


def test_slots_hold_the_pieces_boxes_and_the_rest_are_parked() -> None:
    shared = slots.common([CHAIR, BED])
    for piece in (CHAIR, BED):
        model = compile_scene(piece, shared=shared)
        used = [model.geom(f"slot{i}").contype[0] == 2 for i in range(shared.slots)]
        assert used == [i < len(piece.boxes) for i in range(shared.slots)]
        for index, box in enumerate(piece.boxes):
            np.testing.assert_allclose(model.geom(f"slot{index}").size, box.half_m)
            np.testing.assert_allclose(model.geom(f"slot{index}").pos, box.centre_m)


def test_an_empty_floor_has_nothing_to_meet() -> None:
    model = compile_scene(None)
    names = [model.geom(i).name for i in range(model.ngeom)]
    assert all(model.geom(n).contype[0] == 4 for n in names if n.startswith("slot"))
    data = mujoco.MjData(model)
    data.qpos[2] = 5.0
    mujoco.mj_forward(model, data)
    own = {int(data.contact.geom[i, 0]) for i in range(data.ncon)}
    assert all("slot" not in model.geom(i).name for i in own)


def test_coordinates_are_the_character_s_the_box_s_then_the_balls() -> None:
    model = compile_scene(box_scene.STAND, [Ball(), Ball(2.0, 0.1)], box_scene.box())
    assert (model.nq, model.nv) == (43 + 7 + 14, 34 + 6 + 12)
    assert model.joint(box_scene.BOX_BODY).qposadr[0] == 43
    assert model.body("projectile1").mass[0] == 2.0
    assert model.body("projectile1").jntadr[0] > model.body("projectile0").jntadr[0]
    plain = compile_scene(CHAIR)
    assert (plain.nq, plain.nv, plain.nu) == (43, 34, 28) and plain.nmocap == 1


def test_servo_limits_are_the_callers() -> None:
    model = compile_scene(CHAIR)
    assert not model.actuator_ctrllimited.any() and not model.actuator_forcelimited.any()


@pytest.mark.parametrize("piece", [None, CHAIR], ids=["floor", "chair"])
def test_damping_of_the_joints_moves_the_character_as_the_servos_did(piece: Piece | None) -> None:
    """Against the servos of humanoid.xml, whose derivatives MuJoCo's implicitfast integrates."""
    model = compile_scene(piece)
    servos = compile_scene(piece, limited=True)
    servos.actuator_forcelimited[:] = False
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER
    assert servos.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    draw = np.random.default_rng(0)
    touched = 0
    for _ in range(20):
        found = []
        qpos, qvel = character.standing_qpos(), draw.normal(size=34)
        qpos[:2] = draw.uniform(-0.5, 0.5, size=2)
        ctrl = character.neutral_set_points() + 0.3 * draw.normal(size=28)
        for one in (model, servos):
            data = mujoco.MjData(one)
            data.qpos[:], data.qvel[:], data.ctrl[:] = qpos, qvel, ctrl
            mujoco.mj_step(one, data, character.SUBSTEPS)
            touched += data.ncon
            found.append(data.qvel.copy())
        np.testing.assert_allclose(found[0], found[1], atol=1e-9)
    assert touched > 40


def test_scenes_with_a_box_integrate_its_spin_implicitly() -> None:
    model = compile_scene(box_scene.STAND, cargo=box_scene.box())
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    np.testing.assert_allclose(model.dof_damping[6:34], character.gains()[1])
    calm, carrying = compile_room([CHAIR], [box_scene.box()])
    assert carrying.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert calm.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER


def test_a_room_steps_as_the_scene_of_its_first_box_does() -> None:
    """The other pieces are far away: the box and the character move as in a scene of one box."""
    chair, bed = find("chair-test-000"), find("bed-test-000")
    calm, carrying = compile_room([chair, bed], [box_scene.box(), box_scene.box(0.8)])
    assert calm.nmocap == carrying.nmocap == 2 + 1 + 2
    assert calm.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL and calm.opt.impratio == 1.0
    assert carrying.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert carrying.opt.impratio == box_scene.IMPRATIO
    single = compile_scene(box_scene.STAND, cargo=box_scene.box())
    assert [carrying.body(i).name for i in range(single.nbody)] == [
        single.body(i).name for i in range(single.nbody)
    ]
    found = []
    for model in (single, carrying):
        data = mujoco.MjData(model)
        data.qpos[: character.NQ] = character.standing_qpos()
        data.mocap_pos[:] = [[30.0 + 4 * i, 30.0, 0.0] for i in range(model.nmocap)]
        data.mocap_pos[0] = 0.5, 0.0, 0.8
        # the box falls on its stand, the character beside it falls too
        data.qpos[43:46] = 0.5, 0.0, 1.1
        if model.nq > 50:
            data.qpos[50:53] = 30.0, 30.0, 0.5
        for _ in range(200):
            mujoco.mj_step(model, data)
        found.append(data.qpos[:50].copy())
    assert np.allclose(found[0], found[1], atol=1e-6)


def test_pieces_of_a_room_are_solid() -> None:
    """A box that falls on each piece comes to rest on it."""
    table = find("table-test-000")
    calm, _ = compile_room([table, table], [box_scene.box(0.6)])
    data = mujoco.MjData(calm)
    data.qpos[: character.NQ] = character.standing_qpos()
    data.mocap_pos[:] = [[30.0, 0, 0.5], [33.0, 0, 0.5], [3.0, 0.0, 0.0], [6.0, 0.0, 0.0]]
    top = table.bounds()[1][2]
    for x in (3.0, 6.0):
        data.qpos[43:50] = x, 0.0, top + 0.3, 1.0, 0.0, 0.0, 0.0
        data.qvel[:] = 0.0
        for _ in range(600):
            mujoco.mj_step(calm, data)
        assert data.qpos[45] == pytest.approx(top + 0.3 * 0.6 / 2, abs=0.02)
