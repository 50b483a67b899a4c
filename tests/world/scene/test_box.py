"""The box and its stands in the model: weights, places, and a box that comes to rest."""

import mujoco
import pytest

from world.scene import box as box_scene
from world.scene.model import compile_scene, scene_spec


def test_masses_follow_the_volume_or_the_setting() -> None:
    assert box_scene.box().mass_kg == box_scene.BOX_KG
    assert box_scene.box(0.5).mass_kg == pytest.approx(box_scene.BOX_KG / 8)
    assert box_scene.box(0.5, 3.0).mass_kg == 3.0
    assert box_scene.box(2.0).size_m == pytest.approx([2 * edge for edge in box_scene.BOX_SIZE_M])


def test_a_stand_is_as_high_as_its_frame() -> None:
    low, high = box_scene.STAND.bounds()
    assert high[2] == pytest.approx(0.0) and low[2] < -1.5


def test_a_box_comes_to_rest_on_its_stand() -> None:
    model = compile_scene(box_scene.STAND, cargo=box_scene.box())
    assert model.body(box_scene.BOX_BODY).mass[0] == pytest.approx(box_scene.BOX_KG)
    data = mujoco.MjData(model)
    mujoco.mj_resetData(model, data)
    data.qpos[0] = 50.0  # the character is elsewhere
    data.mocap_pos[0], data.mocap_pos[1] = (2.0, 0.0, 0.6), (4.0, 0.0, 0.5)
    half = box_scene.BOX_SIZE_M[2] / 2
    data.qpos[43:46] = 2.0, 0.0, 0.6 + half + 0.01
    for _ in range(round(1.0 / model.opt.timestep)):
        mujoco.mj_step(model, data)
    assert data.qpos[43:46].tolist() == pytest.approx([2.0, 0.0, 0.6 + half], abs=2e-3)
    assert abs(data.qvel[34:40]).max() < 1e-2


def slipped_m(scale: float, pressed: float, seconds: float) -> float:
    """How far a box slips down between two palms that press it with `pressed` times the force that
    Coulomb's law asks for its weight."""
    cargo = box_scene.box(scale)
    spec = scene_spec(box_scene.STAND, (), cargo)
    middle, radius = (0.0, 20.0, 3.0), 0.04
    for side in (1, -1):
        at = (0.0, middle[1] + side * (cargo.boxes[0].half_m[1] + radius), middle[2])
        palm = spec.worldbody.add_body(name=f"palm{side}", pos=at)
        palm.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(0, -side, 0), damping=[200, 0, 0])
        sphere = palm.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(radius, 0, 0), mass=1.0)
        sphere.contype, sphere.conaffinity = 3, 3
    model = spec.compile()
    data = mujoco.MjData(model)
    start = model.jnt_qposadr[model.joint(box_scene.BOX_BODY).id]
    data.qpos[start : start + 3] = middle
    force = pressed * cargo.mass_kg * 9.81 / (2.0 * box_scene.FRICTION)
    for side in (1, -1):
        data.qfrc_applied[model.body(f"palm{side}").dofadr[0]] = force
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
    return float(middle[2] - data.qpos[start + 2])


@pytest.mark.parametrize("scale", [0.5, 1.0, 1.5])
def test_a_box_neither_creeps_out_of_the_hands_nor_sticks_to_them(scale: float) -> None:
    """An episode of 15 s, in which 13.5 kg slipped by 18 cm; and Coulomb's law: with less than the
    weight needs, it slips."""
    assert slipped_m(scale, 3.0, 15.0) < 0.06
    assert slipped_m(scale, 0.8, 0.5) > 0.1
