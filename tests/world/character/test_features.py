"""The 114 features against the simulator itself, and what they must not depend on."""

import mujoco
import numpy as np
import pytest
import torch

from tests.support.samp_clips import needs_samp, prepared
from world import rotations
from world.character import features
from world.character import model as character
from world.furniture.catalogue import find
from world.motions import load
from world.motions.clip import Clip, generalised_velocities, mirrored
from world.scene import model as scene


def test_table() -> None:
    assert features.STATE.width == 114
    assert sum(f.width for f in features.STATE) == 114
    assert len({f.name for f in features.STATE}) == len(list(features.STATE))
    assert features.STATE.slice("root_height") == slice(0, 1)
    assert features.STATE.slice("object_rotation") == slice(108, 114)
    assert slice(105, 114) == features.OBJECT


def simulated(clip: Clip, frames: np.ndarray) -> np.ndarray:
    """The features as MuJoCo itself has them, from its own kinematics and sensors' conventions."""
    model = scene.compile_scene(find("chair-train-000"))
    data = mujoco.MjData(model)
    qpos, qvel = clip.qpos(), clip.qvel()
    place = np.array([1.0, -0.5, 0.0])
    yaw = 0.7
    rows = []
    for frame in frames:
        data.qpos[:], data.qvel[:] = qpos[frame], qvel[frame]
        data.mocap_pos[0], data.mocap_quat[0] = place, (np.cos(yaw / 2), 0, 0, np.sin(yaw / 2))
        mujoco.mj_forward(model, data)
        w, z = data.qpos[3], data.qpos[6]
        heading = 2 * np.arctan2(z, w)
        back = np.array(
            [
                [np.cos(heading), np.sin(heading), 0],
                [-np.sin(heading), np.cos(heading), 0],
                [0, 0, 1],
            ]
        )
        pelvis = data.body("pelvis")
        root = pelvis.xmat.reshape(3, 3)
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(
            model, data, mujoco.mjtObj.mjOBJ_XBODY, model.body("pelvis").id, velocity, 0
        )
        balls, hinges = [], []
        for name, joint in zip(character.JOINT_BODIES, character.JOINTS, strict=True):
            body = character.BODIES[name]
            if joint.is_ball:
                parent = model.body(model.body(body).parentid[0]).name
                local = data.body(parent).xmat.reshape(3, 3).T @ data.body(body).xmat.reshape(3, 3)
                balls += [local[:, 0], local[:, 2]]
            else:
                hinges.append(data.joint(joint.name).qpos)
        joint_velocity = np.concatenate([data.joint(j.name).qvel for j in character.JOINTS])
        chair = data.body(scene.FURNITURE_BODY)
        axes = chair.xmat.reshape(3, 3)
        rows.append(
            np.concatenate(
                [
                    pelvis.xpos[2:3],
                    back @ root[:, 0],
                    back @ root[:, 2],
                    back @ velocity[3:],
                    back @ velocity[:3],
                    *balls,
                    *hinges,
                    joint_velocity,
                    *(back @ (data.body(b).xpos - pelvis.xpos) for b in features.KEY_BODIES),
                    back @ (chair.xpos - pelvis.xpos),
                    back @ axes[:, 0],
                    back @ axes[:, 2],
                ]
            )
        )
    return np.stack(rows)


def check_replay(clip: Clip) -> None:
    frames = np.arange(0, clip.frames, max(1, clip.frames // 60))
    body = features.body(
        torch.from_numpy(clip.qpos()[frames]), torch.from_numpy(clip.qvel()[frames])
    )
    n = len(frames)
    place = torch.tensor([1.0, -0.5, 0.0]).expand(n, 3)
    yaw = torch.tensor([np.cos(0.7), np.sin(0.7)], dtype=torch.float32).expand(n, 2)
    ours = features.state(body, place, yaw)
    np.testing.assert_allclose(ours.numpy(), simulated(clip, frames), atol=1e-4)


@pytest.fixture(scope="module")
def own() -> list[Clip]:
    return load.own_clips()


def test_replay_of_own_clips(own: list[Clip]) -> None:
    for clip in own[:4]:
        check_replay(clip)


@needs_samp
@pytest.mark.parametrize("name", ["armchair001", "chair_mo004", "run_circular"])
def test_replay_of_mocap(name: str) -> None:
    check_replay(prepared(name))


def test_velocities_are_the_simulators() -> None:
    """Free fall and spin: qvel by differences of frames that MuJoCo integrated itself."""
    spec = character.spec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.option.timestep = 1 / 3000
    model = spec.compile()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    data.qvel[:] = 0.5 * rng.normal(size=model.nv)
    data.qpos[2] = 3.0
    qpos, qvel = [], []
    for _ in range(12):
        qpos.append(data.qpos.copy())
        qvel.append(data.qvel.copy())
        for _ in range(100):
            mujoco.mj_step(model, data)
    found = generalised_velocities(np.array(qpos, np.float32), 30.0)
    # central differences over 1/15 s round off what accelerates within it
    error = np.abs(found[1:-1] - np.array(qvel)[1:-1])
    assert np.sqrt(np.square(error).mean()) < 0.02
    assert error.max() < 0.15


def test_features_ignore_where_and_whither(own: list[Clip]) -> None:
    """Moving and turning the whole scene leaves every feature as it was."""
    clip = own[0]
    qpos, qvel = torch.from_numpy(clip.qpos()), torch.from_numpy(clip.qvel())
    n = len(qpos)
    place, facing = (
        torch.tensor([2.0, 1.0, 0.0]).expand(n, 3),
        torch.tensor([0.6, 0.8]).expand(n, 2),
    )
    first = features.state(features.body(qpos, qvel), place, facing)

    turn = torch.tensor([np.cos(1.1), np.sin(1.1)], dtype=torch.float32)
    shift = torch.tensor([-4.0, 3.0, 0.0])
    q = torch.tensor([np.cos(0.55), 0.0, 0.0, np.sin(0.55)], dtype=torch.float32)
    moved = qpos.clone()
    moved[:, :3] = rotations.turn(turn, qpos[:, :3]) + shift
    moved[:, 3:7] = rotations.multiply(q.expand(n, 4), qpos[:, 3:7])
    turned = qvel.clone()
    turned[:, :3] = rotations.turn(turn, qvel[:, :3])
    second = features.state(
        features.body(moved, turned),
        rotations.turn(turn, place) + shift,
        rotations.turn(turn, facing),
    )
    torch.testing.assert_close(first, second, atol=2e-5, rtol=0)


def test_mirrored_features_are_those_of_the_mirrored_clip(own: list[Clip]) -> None:
    clip = own[0]
    body = features.body(torch.from_numpy(clip.qpos()), torch.from_numpy(clip.qvel()))
    other = mirrored(clip)
    image = features.body(torch.from_numpy(other.qpos()), torch.from_numpy(other.qvel()))
    flip = torch.tensor([1.0, -1.0, 1.0])
    torch.testing.assert_close(image.root, body.root * flip)
    swapped = list(character.MIRROR_BODIES)
    torch.testing.assert_close(image.position, body.position[:, swapped] * flip, atol=1e-5, rtol=0)
    table = features.STATE
    for name in ("root_linear_velocity", "position_right_hand"):
        partner = name.replace("right", "left")
        torch.testing.assert_close(
            image.features[:, table.slice(name)],
            body.features[:, table.slice(partner)] * flip,
            atol=1e-4,
            rtol=0,
        )
    spin = table.slice("root_angular_velocity")
    torch.testing.assert_close(
        image.features[:, spin], body.features[:, spin] * -flip, atol=1e-3, rtol=0
    )
