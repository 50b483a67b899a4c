"""Another body's units, rate and axes."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from tests.support import foreign_motions
from world import rotations
from world.character import kinematics
from world.errors import ClipError
from world.motions.clip import Clip
from world.motions.fit import floor
from world.motions.formats import landmarks
from world.motions.retarget import body


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


def test_smpl_up_is_z_unless_the_person_stands_along_y(walking: Clip) -> None:
    plain = foreign_motions.recorded(walking)
    joint = landmarks.find(plain)
    assert body.upward(plain, joint) == "y"
    assert body.upward(replace(plain, likely_up="z"), joint) == "y"
    turn = foreign_motions.Y_UP.T
    other = replace(plain, position=plain.position @ turn.T, rotation=turn @ plain.rotation)
    assert body.upward(other, joint) == "z"
    assert body.upward(replace(other, likely_up="z"), joint) == "z"
