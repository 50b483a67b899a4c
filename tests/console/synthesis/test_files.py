"""Every file read back by somebody else."""

from pathlib import Path

import mujoco
import numpy as np
import pybvh
import pytest

from console.app import main
from console.recording import format as recording
from world.character import model as character
from world.furniture.catalogue import find
from world.motions import load


def bodies(take: recording.Take) -> np.ndarray:
    """Positions [T, 15, 3] m of the character's bodies: MuJoCo's own kinematics."""
    model = character.spec().compile()
    data = mujoco.MjData(model)
    found = []
    for qpos in take.qpos:
        data.qpos[:] = qpos[: character.NQ]
        mujoco.mj_kinematics(model, data)
        found.append(data.xpos[1:].copy())
    return np.stack(found)


def y_up_cm(positions: np.ndarray) -> np.ndarray:
    """In BVH's axes: ours are x forward, y left, z up."""
    x, y, z = np.moveaxis(positions, -1, 0)
    return 100.0 * np.stack((y, z, x), axis=-1)


def test_bvh_read_by_another_has_the_same_joints(files: dict[str, Path]) -> None:
    take = recording.read(files[".msgpack"]).takes[0]
    read = pybvh.read_bvh_file(files[".bvh"])
    assert read.world_up == "+y" and read.frame_count == len(take)
    assert read.fps == pytest.approx(30.0, abs=1e-4)
    assert list(read.joint_names) == list(character.BODIES)
    wanted = y_up_cm(bodies(take))
    assert np.abs(read.joint_positions() - wanted).max() < 0.1, "a millimetre"
    # no angle jumps where the motion does not
    assert np.abs(np.diff(read.joint_angles, axis=0)).max() < np.pi / 2


def test_bvh_has_the_form_that_animation_programs_expect(files: dict[str, Path]) -> None:
    lines = [line.strip() for line in files[".bvh"].read_text().splitlines()]
    assert lines[0] == "HIERARCHY" and lines[1] == "ROOT pelvis"
    channels = [line for line in lines if line.startswith("CHANNELS")]
    angles = "Zrotation Xrotation Yrotation"
    assert channels[0] == f"CHANNELS 6 Xposition Yposition Zposition {angles}"
    assert channels[1:] == [f"CHANNELS 3 {angles}"] * 14
    assert lines.count("End Site") == 5 and lines.count("{") == lines.count("}") == 20
    at = lines.index("MOTION")
    frames = int(lines[at + 1].removeprefix("Frames:"))
    assert lines[at + 2] == "Frame Time: 0.0333333"
    assert len(lines) == at + 3 + frames
    assert {len(line.split()) for line in lines[at + 3 :]} == {3 + 3 * 15}


def test_a_clip_is_read_as_it_was(files: dict[str, Path]) -> None:
    clip = load.read(files[".npz"])
    take = recording.read(files[".msgpack"]).takes[0]
    np.testing.assert_allclose(clip.qpos()[:, :3], take.qpos[:, :3], atol=1e-5)
    ball = character.BALL_QPOS[3]
    dots = (clip.qpos()[:, ball : ball + 4] * take.qpos[:, ball : ball + 4]).sum(1)
    np.testing.assert_allclose(np.abs(dots), 1.0, atol=1e-4)
    hinges = list(character.HINGE_QPOS)
    np.testing.assert_allclose(clip.qpos()[:, hinges], take.qpos[:, hinges], atol=1e-3)
    assert clip.fps == 30 and "research only" in clip.licence and "synthesised" in clip.source
    assert clip.seat is not None and clip.seat.to_frame == clip.frames
    np.testing.assert_allclose(clip.seat.point_m, find("chair-test-000").sit[0].point_m, atol=1e-5)
    assert (
        main(["motions", "play", str(files[".npz"]), "--html", str(files[".npz"]) + ".html"]) == 0
    )
    assert oct(files[".npz"].stat().st_mode)[-3:] == "644"


def test_full_states_go_on_as_they_went(files: dict[str, Path]) -> None:
    """A frame's state and the next one's targets are all that MuJoCo needs to make the next."""
    take = recording.read(files[".msgpack"]).takes[0]
    model = recording.model_of(take)
    data = mujoco.MjData(model)
    for frame in (0, 20, len(take) - 2):
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = take.qpos[frame], take.qvel[frame]
        data.mocap_pos[0], data.mocap_quat[0] = take.mocap_pos[frame], take.mocap_quat[frame]
        data.ctrl[:] = take.ctrl[frame + 1]
        for _ in range(character.SUBSTEPS):
            mujoco.mj_step(model, data)
        np.testing.assert_allclose(data.qpos, take.qpos[frame + 1], atol=2e-4)
