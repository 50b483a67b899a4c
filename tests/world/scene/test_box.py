"""The box and its stands in the model: weights, places, and a box that comes to rest."""

import mujoco
import pytest

from world.scene import box as box_scene
from world.scene.model import compile_scene


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
