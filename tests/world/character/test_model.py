"""The character: its table, its servos, and that its physics holds."""

import mujoco
import numpy as np
import pytest

from world.character import model as character
from world.scene import model as scene


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return scene.compile_scene(None)


def test_masses_and_lengths(model: mujoco.MjModel) -> None:
    masses = {
        "pelvis": 10.0,
        "torso": 12.0,
        "head": 3.9,
        "upper_arm": 1.5,
        "lower_arm": 1.0,
        "hand": 0.5,
        "thigh": 4.5,
        "shin": 3.0,
        "foot": 1.0,
    }
    for body in character.BODIES:
        kind = body.removeprefix("right_").removeprefix("left_")
        assert model.body(body).mass[0] == pytest.approx(masses[kind]), body
    own = [model.body(b).id for b in character.BODIES]
    assert model.body_mass[own].sum() == pytest.approx(48.9)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pelvis, foot = data.body("pelvis").xpos, data.body("right_foot").xpos
    # hip at the root's height, thigh 0.4215, shin 0.4099
    assert pelvis[2] - foot[2] == pytest.approx(0.421546 + 0.40987, abs=1e-6)
    top = data.geom("head").xpos[2] + 0.095
    sole = data.geom("right_foot").xpos[2] - 0.0275
    assert top - sole == pytest.approx(1.61, abs=0.02)


def test_layout(model: mujoco.MjModel) -> None:
    assert (model.nq, model.nv, model.nu) == (character.NQ, character.NV, character.NU)
    assert model.opt.timestep == pytest.approx(1 / 120)
    low, high = character.set_point_bounds()
    alone = character.spec().compile()
    assert alone.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    np.testing.assert_allclose(alone.actuator_ctrlrange, np.stack([low, high], 1), atol=1e-12)
    assert (character.neutral_set_points() > low).all()
    assert (character.neutral_set_points() < high).all()
    limits = [j.limit_nm for j in character.JOINTS for _ in j.range_deg]
    np.testing.assert_allclose(alone.actuator_forcerange[:, 1], limits)
    # in a scene the limits are world.character.servos': nothing clamps behind its back
    assert not model.actuator_ctrllimited.any()
    assert not model.actuator_forcelimited.any()


def test_each_spec_is_one_of_its_own() -> None:
    changed = character.spec()
    changed.option.timestep = 1.0
    changed.body("pelvis").pos = [9.0, 9.0, 9.0]
    changed.worldbody.add_body(name="stranger")
    other = character.spec()
    assert other.option.timestep == pytest.approx(1 / 120) and other.body("stranger") is None
    np.testing.assert_allclose(other.body("pelvis").pos, [0.0, 0.0, 0.89])
    assert changed.compile().nbody == other.compile().nbody + 1


def test_left_mirrors_right() -> None:
    joints = {j.name: j for j in character.JOINTS}
    assert joints["right_hip"].range_deg == ((-60, 15), (-140, 60), (-60, 35))
    assert joints["left_hip"].range_deg == ((-15, 60), (-140, 60), (-35, 60))
    assert joints["left_shoulder"].range_deg[0] == (-45, 180)


@pytest.mark.parametrize("actuator", range(character.NU))
@pytest.mark.parametrize("share", [0.15, 0.85])
def test_each_servo_reaches_its_target(actuator: int, share: float) -> None:
    spec = character.spec()
    spec.option.gravity = [0, 0, 0]
    model = spec.compile()
    low, high = character.set_point_bounds()
    # a rotation vector beyond π is another rotation: stay below it
    target = np.clip(low + share * (high - low), -2.6, 2.6)[actuator]
    data = mujoco.MjData(model)
    mujoco.mj_resetData(model, data)
    data.ctrl[:] = 0.0
    data.ctrl[actuator] = target
    for _ in range(480):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    # hinges start at 0, their own bound; the joint's soft limit gives way by a few milliradians
    assert data.actuator_length[actuator] == pytest.approx(target, abs=5e-3)
    others = np.delete(data.actuator_length, actuator)
    assert np.abs(others).max() < 5e-3


def test_three_axes_at_once_reach_a_rotation_vector() -> None:
    spec = character.spec()
    spec.option.gravity = [0, 0, 0]
    model = spec.compile()
    data = mujoco.MjData(model)
    first = model.actuator("abdomen_x").id
    target = np.array([0.9, 0.6, -0.5])
    data.ctrl[first : first + 3] = target
    for _ in range(480):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.actuator_length[first : first + 3], target, atol=1e-3)


def test_standing_for_ten_seconds(model: mujoco.MjModel) -> None:
    """Held servos are a stiff statue: it stands while its centre of mass stays over its feet."""
    data = mujoco.MjData(model)
    data.qpos[:] = character.standing_qpos()
    mujoco.mj_forward(model, data)
    data.ctrl[:] = data.actuator_length
    heights, over = [], []
    for _ in range(1200):
        mujoco.mj_step(model, data)
        com = data.subtree_com[model.body("pelvis").id]
        feet = [data.geom(f"{side}_foot").xpos for side in ("right", "left")]
        heights.append(data.qpos[2])
        over.append(abs(com[0] - np.mean(feet, axis=0)[0]) < 0.0885)
        if not over[-1]:
            break
    assert sum(w.number for w in data.warning) == 0
    # stable, or, once the centre of mass has left the feet, falling: never kicked upwards
    assert max(heights) < character.standing_qpos()[2] + 0.02
    stood = sum(over) / 120
    assert stood > 0.5
    if all(over):
        assert heights[-1] > 0.8
