"""Models of scenes: one layout for all pieces, parked slots, and what meets what."""

import mujoco
import numpy as np

from world.furniture.catalogue import find
from world.scene import box as box_scene
from world.scene import slots
from world.scene.model import Ball, compile_scene

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
