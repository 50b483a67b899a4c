"""Clips: velocities, mirrors and cuts."""

import mujoco
import numpy as np
import torch

from tests.support.samp_clips import FOLDER, needs_samp
from world.character import features
from world.character import model as character
from world.motions import load
from world.motions.clip import Clip, hinge_angles, mirrored


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


def test_mirroring_twice_is_the_clip(sitting: Clip) -> None:
    twice = mirrored(mirrored(sitting))
    np.testing.assert_array_equal(twice.root_position_m, sitting.root_position_m)
    np.testing.assert_array_equal(twice.local_rotation, sitting.local_rotation)
    assert twice.seat == sitting.seat


@needs_samp
def test_elbows_and_knees_have_one_axis_and_lying_is_no_sitting() -> None:
    for path in sorted(FOLDER.glob("*.npz"))[::9]:
        _, swing = hinge_angles(load.read(path).local_rotation)
        assert swing.max() < np.deg2rad(2), path.name
    for name in ("lie_down", "lie_down_16", "lie_down_18"):
        assert load.clips((str(FOLDER / f"{name}.npz"),)) == []
