"""Boxes to carry: two hands can hold one, a loose grip drops it; sizes, weights, the squeeze."""

import math

import mujoco
import numpy as np
import pytest
import torch

from world.character import model as character
from world.config import CarryConfig
from world.errors import ConfigError, PieceError
from world.furniture.catalogue import find
from world.initial import squeeze
from world.objects.box_bank import BoxBank, boxes
from world.scene import box as box_scene
from world.scene.box import BOX_KG, box
from world.scene.model import compile_scene


def hands_walk(force_n: float, seconds: float = 4.0) -> tuple[float, float]:
    """Two spheres of the hands' size press on the default box with force_n each, stand for 1 s and
    walk on at 1 m/s, bobbing 2 cm at 2 Hz as a walker does; (slip of the box in the hands, tilt) in
    m and degrees, (inf, inf) where it falls."""
    spec = mujoco.MjSpec()
    spec.option.timestep = character.TIMESTEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    cargo = box()
    box_scene.add(spec, cargo)
    start = cargo.boxes[0].half_m[1] + 0.04
    for name, side in (("right", -1.0), ("left", 1.0)):
        hand = spec.worldbody.add_body(name=name, pos=[0, side * start, 1.0])
        hand.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.04, 0, 0], mass=2.0, contype=1,
            conaffinity=2, condim=3, friction=[1, 0.05, 0.001],
        )  # fmt: skip
        for axis, along in (("x", [1, 0, 0]), ("y", [0, 1, 0]), ("z", [0, 0, 1])):
            joint = hand.add_joint(name=name + axis, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=along)
            motor = spec.add_actuator(
                name=name + axis, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint.name
            )
            if axis == "y":
                motor.set_to_motor()
            else:
                motor.set_to_position(kp=5000, kv=400)
    model = spec.compile()
    data = mujoco.MjData(model)
    address = model.joint("box").qposadr[0]
    data.qpos[address : address + 7] = [0, 0, 1.0, 1, 0, 0, 0]
    data.mocap_pos[0] = [-5, 0, 0.5]
    offset = np.zeros(3)
    settled = None
    for step in range(round(seconds / model.opt.timestep)):
        walked = max(0.0, step * model.opt.timestep - 1.0)
        # up to 1 m/s within half a second
        ahead = min(walked, 0.5) ** 2 + max(0.0, walked - 0.5)
        for name, side in (("right", 1.0), ("left", -1.0)):
            data.ctrl[model.actuator(name + "x").id] = ahead
            data.ctrl[model.actuator(name + "y").id] = side * force_n
            data.ctrl[model.actuator(name + "z").id] = 0.02 * math.sin(4 * math.pi * walked)
        mujoco.mj_step(model, data)
        middle = 0.5 * (data.xpos[model.body("right").id] + data.xpos[model.body("left").id])
        offset = data.qpos[address : address + 3] - middle
        if walked <= 0.0:
            settled = offset.copy()
        if data.qpos[address + 2] < 0.3:
            return math.inf, math.inf
    upright = np.zeros(9)
    mujoco.mju_quat2Mat(upright, data.qpos[address + 3 : address + 7])
    assert settled is not None
    tilt = math.degrees(math.acos(min(1.0, upright[8])))
    return float(np.linalg.norm((offset - settled)[[0, 2]])), tilt


def test_sparse_matrices_are_only_faster() -> None:
    ends = []
    for matrix in (mujoco.mjtJacobian.mjJAC_SPARSE, mujoco.mjtJacobian.mjJAC_DENSE):
        model = compile_scene(box_scene.STAND, (), box())
        assert model.opt.jacobian == mujoco.mjtJacobian.mjJAC_SPARSE
        model.opt.jacobian = matrix
        data = mujoco.MjData(model)
        data.qpos[: character.NQ] = character.standing_qpos()
        # the box drops onto the stand, its edge ahead, beside a character that gives way
        data.qpos[character.NQ :] = [0.45, 0.0, 0.80, 0.98, 0.0, 0.2, 0.0]
        data.mocap_pos[:] = [[0.45, 0.0, 0.6], [3.0, 0.0, 0.6]]
        for _ in range(120):
            mujoco.mj_step(model, data)
        ends.append(data.qpos.copy())
        assert data.ncon > 4
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-7)


def test_a_squeeze_carries_the_box_and_a_loose_grip_drops_it() -> None:
    # two contacts of friction 1.2 bear 4 kg from 16.4 N on
    needed = BOX_KG * 9.81 / (2 * box_scene.FRICTION)
    assert needed == pytest.approx(16.35, abs=0.01)
    slip, tilt = hands_walk(1.8 * needed)
    assert slip < 0.03
    assert tilt < 5.0
    assert hands_walk(0.85 * needed) == (math.inf, math.inf)


def test_boxes_have_the_sizes_and_weights_of_the_config() -> None:
    found = boxes(CarryConfig(sizes=11))
    widths = [2 * piece.boxes[0].half_m[1] for piece in found]
    assert min(widths) == pytest.approx(0.5 * (0.5 + 1 / 22))
    assert max(widths) == pytest.approx(0.5 * (1.5 - 1 / 22))
    assert found[5].mass_kg == pytest.approx(BOX_KG)
    assert found[0].mass_kg == pytest.approx(BOX_KG * (0.5 + 1 / 22) ** 3)
    weighed = boxes(CarryConfig(sizes=20, weight_kg=(2.0, 10.0)))
    masses = [piece.mass_kg for piece in weighed]
    assert 2.0 <= min(masses) < 2.8
    assert 9.2 < max(masses) <= 10.0
    # size and weight are independent
    assert abs(np.corrcoef(masses, np.arange(20))[0, 1]) < 0.2
    bank = BoxBank(weighed[:3])
    for model, piece in zip(bank.models, weighed, strict=False):
        assert model.body_mass[model.body("box").id] == pytest.approx(piece.mass_kg)
        assert tuple(model.geom("box").size) == pytest.approx(piece.boxes[0].half_m)
    with pytest.raises(ConfigError, match="weights above 0 kg"):
        boxes(CarryConfig(weight_kg=(5.0, 2.0)))
    with pytest.raises(ConfigError, match="sizes above 0"):
        boxes(CarryConfig(scale=(0.0, 1.0)))
    with pytest.raises(PieceError, match="chair-train-000: is no box to carry"):
        BoxBank([find("chair-train-000")])


def test_a_squeeze_is_the_transposed_jacobian() -> None:
    """Against MuJoCo's Jacobian of the hands."""
    model = character.spec().compile()
    data = mujoco.MjData(model)
    qpos = character.standing_qpos()
    # the arms forward and bent
    for name, angles in (("right_shoulder", (0.2, -0.6, 0.1)), ("left_shoulder", (-0.1, -0.5, 0))):
        address = model.joint(name).qposadr[0]
        turn = np.zeros(4)
        vector = np.array(angles, dtype=float)
        mujoco.mju_axisAngle2Quat(turn, vector / np.linalg.norm(vector), np.linalg.norm(vector))
        qpos[address : address + 4] = turn
    for name in ("right_elbow", "left_elbow"):
        qpos[model.joint(name).qposadr[0]] = 1.1
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    ids = [model.body(f"{side}_hand").id for side in ("right", "left")]
    line = data.xpos[ids[1]] - data.xpos[ids[0]]
    line /= np.linalg.norm(line)
    torque = np.zeros(model.nv)
    for body, sign in zip(ids, (1.0, -1.0), strict=True):
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, data.xpos[body], body)
        force = sign * 30.0 * line + np.array([0.0, 0.0, 0.5 * 20.0])
        arm = [
            dof
            for joint in character.JOINTS
            if joint.name.endswith(("shoulder", "elbow"))
            for dof in range(
                model.joint(joint.name).dofadr[0],
                model.joint(joint.name).dofadr[0] + (3 if joint.is_ball else 1),
            )
        ]
        torque[arm] += (jacobian.T @ force)[arm]
    expected = torque[6:] / character.gains()[0]
    found = squeeze.squeeze(
        torch.from_numpy(qpos).float()[None], torch.tensor([30.0]), torch.tensor([20.0])
    )[0]
    torch.testing.assert_close(found.double(), torch.from_numpy(expected), atol=2e-3, rtol=0.03)
    assert expected.max() > 0.02
