"""Retargeting against known truth: our own walk, as another body would have recorded it."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from tests.support import foreign_motions
from world import rotations
from world.character import features, kinematics
from world.character import model as character
from world.errors import ClipError
from world.motions import augment, measures
from world.motions.clip import Clip, mirrored
from world.motions.fit import floor, poses
from world.motions.formats import landmarks, own
from world.motions.retarget import body, contacts, convert, limits, solve
from world.motions.synthetic import library


@pytest.fixture(scope="module")
def walking() -> Clip:
    return library.walking(np.random.default_rng(0), 1.2).part(20, 80)


@pytest.fixture(scope="module")
def imported(walking: Clip) -> Clip:
    return convert.retargeted(foreign_motions.recorded(walking))


def aligned(clip: Clip) -> np.ndarray:
    """Body positions [T, 15, 3] seen from where the clip begins."""
    position = poses.body_poses(clip)[0].numpy()
    yaw = rotations.heading(torch.from_numpy(clip.local_rotation[:1, 0]))
    seen = rotations.turn_back(yaw[:, None], torch.from_numpy(position - position[:1, :1]))
    return seen.numpy() + np.array([0, 0, position[0, 0, 2]])


def test_another_bodys_walk_is_ours_again(walking: Clip, imported: Clip) -> None:
    assert imported.fps == character.CONTROL_HZ
    assert imported.frames == walking.frames
    apart = np.linalg.norm(aligned(imported) - aligned(walking), axis=-1)
    # hands and feet, and the whole body: size, axes and zero pose are undone
    assert apart[:, [5, 8, 11, 14]].mean() < 0.02
    assert apart.mean() < 0.02
    assert measures.key_body_error_m(imported) < 0.02


def test_standing_feet_stand(walking: Clip, imported: Clip) -> None:
    # the recorded feet tremble by a centimetre where they should stand
    recording = foreign_motions.recorded(walking)
    shaken = recording.position.copy()
    noise = np.random.default_rng(1).normal(size=(len(shaken), 1, 3)) * [0.6, 0.0, 0.6]
    shaken[:, [11, 14, 15, 16]] += noise
    clip = convert.retargeted(replace(recording, position=shaken))
    before, after = measures.skates_m_s(clip)
    assert before > 0.15
    assert after < 0.5 * before
    assert measures.skates_m_s(imported)[1] < 0.05
    # a foot that was flat and still is: sole on the floor, level
    position, rotation = poses.body_poses(imported)
    target = body.targets(
        body.scaled(foreign_motions.recorded(walking), landmarks.find(
            foreign_motions.recorded(walking)), 30)
    )  # fmt: skip
    flat = contacts.find(target, 30).flat
    assert flat.sum() > 15
    ankles = position[:, [11, 14], 2].numpy()[flat]
    np.testing.assert_allclose(ankles, body.ANKLE_M, atol=0.006)
    assert (rotation[:, [11, 14], 2, 2].numpy()[flat] > np.cos(np.deg2rad(4))).all()


def test_limits_hold_and_nothing_sinks(walking: Clip) -> None:
    # a recording that does what no joint can, 20 cm below the floor
    local = walking.local_rotation[:12].astype(float).copy()
    local[:, 9] = Rotation.from_rotvec([1.6, 0.4, 1.2]).as_quat(scalar_first=True)
    local[:, 3] = Rotation.from_rotvec([1.5, 0, 1.9]).as_quat(scalar_first=True)
    root = walking.root_position_m[:12].astype(float) - [0, 0, 0.2]
    turn = Rotation.from_quat(local.reshape(-1, 4), scalar_first=True).as_matrix()
    position, rotation = foreign_motions.forward(
        character.PARENTS, own.offsets(), turn.reshape(-1, 15, 3, 3), root
    )
    target = body.Targets(position[:, 0], rotation, position[:, [11, 14]], position[:, [5, 8]])
    place, quaternion = solve.solved(target)
    clip = Clip("x", 30, place, quaternion, "", "")
    share, most, _ = measures.past_limits(clip)
    assert share == 0, np.rad2deg(most)
    assert measures.penetration_m(clip) < 0.005


def test_joint_ranges_are_linear_in_the_step() -> None:
    """d(rotation vector) of ball joints against finite differences."""
    generator = np.random.default_rng(2)
    model = character.spec().compile()
    qpos = character.standing_qpos()
    for address in character.BALL_QPOS:
        turn = Rotation.from_rotvec(generator.uniform(-1.2, 1.2, 3))
        qpos[address : address + 4] = turn.as_quat(scalar_first=True)
    vector, jacobian = limits.axes(qpos)
    for joint, dof in enumerate(character.BALL_DOF):
        for axis in range(3):
            step = np.zeros(character.NV)
            step[dof + axis] = 1e-6
            moved = qpos.copy()
            mujoco.mj_integratePos(model, moved, step, 1.0)
            slope = (limits.axes(moved)[0][joint] - vector[joint]) / 1e-6
            np.testing.assert_allclose(jacobian[joint][:, axis], slope, atol=1e-5)


def test_velocities_are_the_simulators(imported: Clip) -> None:
    """Replayed kinematically: bodies move as fast as the clip's qvel makes MuJoCo say."""
    model = character.spec().compile()
    data = mujoco.MjData(model)
    qpos, qvel = imported.qpos().astype(float), imported.qvel().astype(float)
    places, reported = [], []
    for q, v in zip(qpos, qvel, strict=True):
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        places.append(data.xpos[1:].copy())
        velocity = np.zeros((15, 6))
        for index in range(15):
            mujoco.mj_objectVelocity(
                model, data, mujoco.mjtObj.mjOBJ_XBODY, index + 1, velocity[index], 0
            )
        reported.append(velocity[:, 3:])
    moved = np.gradient(np.array(places), axis=0) * imported.fps
    error = np.linalg.norm(moved - np.array(reported), axis=-1)[1:-1]
    # central differences on a chord: a few cm/s where a foot swings at 4 m/s
    assert error.mean() < 0.02
    assert error.max() < 0.3
    seen = features.body(torch.from_numpy(imported.qpos()), torch.from_numpy(imported.qvel()))
    np.testing.assert_allclose(seen.position.numpy(), np.array(places), atol=2e-5)
    np.testing.assert_allclose(seen.root_velocity.numpy(), np.array(reported)[:, 0], atol=2e-5)


def test_mirrored_features_are_the_features_mirrored(imported: Clip) -> None:
    own_features = features.body(
        torch.from_numpy(imported.qpos()), torch.from_numpy(imported.qvel())
    ).features
    other = mirrored(imported)
    theirs = features.body(torch.from_numpy(other.qpos()), torch.from_numpy(other.qvel())).features
    table, expected = features.STATE, torch.empty_like(own_features)
    vector, axial = torch.tensor([1.0, -1, 1]), torch.tensor([-1.0, 1, -1])
    # columns x and z of M R M, with M the reflection of y
    columns = torch.tensor([1.0, -1, 1, 1, -1, 1])
    swap = {"right": "left", "left": "right"}
    for feature in table:
        if feature.name.startswith("object") or feature.name == "joint_velocity":
            continue
        name = feature.name
        for side in swap:
            if f"_{side}_" in feature.name:
                name = feature.name.replace(side, swap[side])
        value = own_features[:, table.slice(name)]
        sign: torch.Tensor | float = 1.0
        if "rotation" in name:
            sign = columns
        elif name == "root_angular_velocity":
            sign = axial
        elif name == "root_linear_velocity" or name.startswith("position"):
            sign = vector
        expected[:, table.slice(feature.name)] = value * sign
    speed = own_features[:, table.slice("joint_velocity")]
    rows: dict[str, torch.Tensor] = {}
    column = 0
    for joint in character.JOINTS:
        width = len(joint.range_deg)
        rows[joint.name] = speed[:, column : column + width] * (axial if joint.is_ball else 1.0)
        column += width
    swapped = [
        rows[j.name.replace(s, swap[s])] if (s := j.name.split("_")[0]) in swap else rows[j.name]
        for j in character.JOINTS
    ]
    expected[:, table.slice("joint_velocity")] = torch.cat(swapped, dim=1)
    width = features.BODY_WIDTH
    torch.testing.assert_close(theirs[:, :width], expected[:, :width], atol=2e-4, rtol=0)


def test_a_slower_clip_is_the_same_motion_slower(imported: Clip) -> None:
    slow = augment.paced(imported, 0.8)
    assert slow.fps == imported.fps
    assert slow.frames == int((imported.frames - 1) / 0.8) + 1
    # every fifth frame of the slow one is every fourth of the clip
    np.testing.assert_allclose(
        slow.root_position_m[::5][:12], imported.root_position_m[::4][:12], atol=1e-5
    )
    quick, easy = imported.qvel()[4:-4:4], slow.qvel()[5:-5:5]
    n = min(len(quick), len(easy))
    # what both have in common is the pace; neighbours differ by a fifth of a frame
    ratio = np.linalg.norm(easy[:n, :3], axis=1) / np.linalg.norm(quick[:n, :3], axis=1)
    assert np.median(ratio) == pytest.approx(0.8, abs=0.03)
    with pytest.raises(Exception, match="small time scaling is"):
        augment.paced(imported, 2.0)


def test_pacing_keeps_the_seat_with_its_frames() -> None:
    clip = library.sitting(np.random.default_rng(0), 0.44, 1.5, 0.3, 1, back=True)
    assert clip.seat is not None
    seat = augment.paced(clip, 1.25).seat
    assert seat is not None
    assert seat.point_m == clip.seat.point_m
    assert seat.from_frame == pytest.approx(clip.seat.from_frame / 1.25, abs=1)
    assert seat.to_frame == pytest.approx(clip.seat.to_frame / 1.25, abs=1)


def test_units_are_inferred_from_the_legs(walking: Clip) -> None:
    recording = foreign_motions.recorded(walking)
    joint = landmarks.find(recording)
    for unit in (1.0, 0.01, 0.001, 0.0254, 0.0254 / 0.45):
        # recorded() is in cm
        other = replace(recording, position=recording.position * 0.01 / unit)
        assert body.scaled(other, joint, 30).scale == pytest.approx(1 / 1.15, rel=1e-3)
    absurd = replace(recording, position=recording.position * 5e4)
    with pytest.raises(ClipError, match="absurd units"):
        body.scaled(absurd, joint, 30)
    with pytest.raises(ClipError, match="absurd units"):
        body.scaled(replace(recording, unit_m=1.0), joint, 30)


def test_faster_recordings_come_down_to_30_hz(walking: Clip) -> None:
    recording = foreign_motions.recorded(floor.resampled(walking, 120))
    scaled = body.scaled(recording, landmarks.find(recording), 30)
    plain = foreign_motions.recorded(walking)
    expected = body.scaled(plain, landmarks.find(plain), 30)
    frames = min(len(scaled.position), len(expected.position))
    np.testing.assert_allclose(
        scaled.position[:frames, :, :2], expected.position[:frames, :, :2], atol=2e-3
    )


def test_lying_on_the_floor_is_not_standing_along_z(walking: Clip) -> None:
    """A whole clip of somebody who lies still: y stays up, and the floor is under the body."""
    local = np.tile([1.0, 0, 0, 0], (10, 15, 1))
    local[:, 0] = Rotation.from_euler("y", -90, degrees=True).as_quat(scalar_first=True)
    root = np.tile(np.array([0.0, 0, 0.12], np.float32), (10, 1))
    clip = Clip("lying", 30, root, local.astype(np.float32), "", "")
    recording = foreign_motions.recorded(clip)
    scaled = body.scaled(recording, landmarks.find(recording), 30)
    head = scaled.at("head")[0] - scaled.at("left_ankle")[0]
    assert abs(head[2]) < 0.3 * np.linalg.norm(head)
    position, _ = kinematics.forward(
        torch.from_numpy(clip.root_position_m), rotations.matrix(torch.from_numpy(
            clip.local_rotation))
    )  # fmt: skip
    assert position.shape == (10, 15, 3)
    assert scaled.position[..., 2].min() == pytest.approx(0.03, abs=0.03)


def test_every_break_is_named_by_its_time(imported: Clip) -> None:
    assert measures.discontinuities(imported) == []
    root = imported.root_position_m.copy()
    root[20:] += [0.5, 0, 0]
    turned = imported.local_rotation.copy()
    turned[45:, 9] = [0.0, 1.0, 0.0, 0.0]
    broken = replace(imported, root_position_m=root, local_rotation=turned)
    first, second = measures.discontinuities(broken)
    assert first == pytest.approx(19.5 / 30, abs=0.05)
    assert second == pytest.approx(44.5 / 30, abs=0.05)


def test_smpl_up_is_z_unless_the_person_stands_along_y(walking: Clip) -> None:
    plain = foreign_motions.recorded(walking)
    joint = landmarks.find(plain)
    assert body.upward(plain, joint) == "y"
    assert body.upward(replace(plain, likely_up="z"), joint) == "y"
    turn = foreign_motions.Y_UP.T
    other = replace(plain, position=plain.position @ turn.T, rotation=turn @ plain.rotation)
    assert body.upward(other, joint) == "z"
    assert body.upward(replace(other, likely_up="z"), joint) == "z"
