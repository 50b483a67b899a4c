"""The display model has the simulated one's coordinates, and shows its objects."""

import mujoco
import numpy as np
import pytest

from console.recording.format import model_of, pose
from console.video import stage
from tests.support.console.recordings import take
from world.character import model as character
from world.furniture.catalogue import catalogue
from world.scene import box as box_scene
from world.scene.model import Ball, compile_scene


@pytest.mark.parametrize("shapes", ["body", "shapes"])
def test_a_state_puts_every_body_where_the_simulation_has_it(shapes: stage.Shapes) -> None:
    simulated = compile_scene(catalogue("test", 3)[2], [Ball()] * 2, box_scene.box(0.8))
    shown = stage.stage(simulated, "chair-test-000", shapes)
    assert shown.nq == simulated.nq and shown.nmocap == simulated.nmocap
    ours, theirs = mujoco.MjData(shown), mujoco.MjData(simulated)
    for data in (ours, theirs):
        data.qpos[:] = 0.3 * np.random.default_rng(1).normal(size=shown.nq)
        data.mocap_pos[:] = np.random.default_rng(2).normal(size=data.mocap_pos.shape)
    mujoco.mj_kinematics(shown, ours)
    mujoco.mj_kinematics(simulated, theirs)
    for number in range(simulated.nbody):
        name = simulated.body(number).name
        np.testing.assert_allclose(
            ours.body(name).xpos, theirs.body(name).xpos, atol=1e-9, err_msg=name
        )


def test_furniture_has_the_same_surfaces() -> None:
    """Rays from above meet the display model where they meet the simulated one."""
    piece = catalogue("test", 1)[0]
    simulated = compile_scene(piece)
    shown = stage.stage(simulated, piece.name)
    low, high = piece.bounds()
    hit = np.zeros(1, np.int32)
    heights, down = [], np.array([0.0, 0.0, -1.0])
    for model in (simulated, shown):
        data = mujoco.MjData(model)
        data.qpos[2] = -50.0
        mujoco.mj_kinematics(model, data)
        heights.append(
            [
                mujoco.mj_ray(model, data, np.array([x, y, 5.0]), down, None, 1, -1, hit)
                for x in np.linspace(low[0], high[0], 9)
                for y in np.linspace(low[1], high[1], 9)
            ]
        )
    np.testing.assert_allclose(heights[1], heights[0], atol=1e-6)
    assert len(set(np.round(heights[0], 3))) > 1


def test_the_rounded_body_is_symmetric_and_joins_its_bodies() -> None:
    """Each limb's shapes reach from its joint to the next body's."""
    model = stage.character_alone()
    data = mujoco.MjData(model)
    data.qpos[:] = character.standing_qpos()
    mujoco.mj_kinematics(model, data)
    hit = np.zeros(1, np.int32)
    shown = np.array([1, 0, 0, 0, 0, 0], np.uint8)
    for name in character.BODIES[1:]:
        at = data.body(name).xpos
        # a ray through the joint from the front meets the body less than 20 cm before it
        start = at + np.array([1.0, 0.0, 0.0])
        reach = mujoco.mj_ray(model, data, start, np.array([-1.0, 0, 0]), shown, 1, -1, hit)
        assert 0.8 < reach <= 1.0, name
        mirrored = start * np.array([1.0, -1.0, 1.0])
        back = mujoco.mj_ray(model, data, mirrored, np.array([-1.0, 0, 0]), shown, 1, -1, hit)
        assert back == pytest.approx(reach, abs=1e-9), name


def test_colour_follows_the_class_and_the_light_the_view() -> None:
    shown = stage.stage(compile_scene(catalogue("test", 1)[0]), "low-stool-test-000")
    objects = shown.geom_rgba[shown.geom_group == stage.OBJECTS]
    assert len(objects) and objects == pytest.approx(
        np.tile(stage.FURNITURE["stool"], (len(objects), 1))
    )
    stage.light_at(shown, np.array([3.0, -2.0, 0.5]))
    way = np.array([3.0, -2.0, 0.5]) - shown.light("sun").pos
    np.testing.assert_allclose(way / np.linalg.norm(way), shown.light("sun").dir, atol=2e-3)


def test_a_take_is_posed_on_it() -> None:
    one = take(2)
    shown = stage.stage(model_of(one), one.piece)
    data = mujoco.MjData(shown)
    pose(shown, data, one, 1)
    np.testing.assert_allclose(data.mocap_pos[0], one.mocap_pos[1])
