"""Recordings: forward kinematics by hand, and what is no usable motion."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from world.errors import ClipError
from world.motions.formats.recording import Recording, forward, validate


def recording(frames: int = 3) -> Recording:
    return Recording(
        "walk", 30.0, ("a", "b"), (-1, 0), np.zeros((frames, 2, 3)),
        np.tile(np.eye(3), (frames, 2, 1, 1)), "walk.x", "none",
    )  # fmt: skip


def test_a_chain_by_hand() -> None:
    """A quarter turn about z at each of two joints, a metre along x apart."""
    quarter = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    local = np.tile(quarter, (1, 3, 1, 1))
    offset = np.array([[9.0, 9, 9], [1.0, 0, 0], [1.0, 0, 0]])
    position, rotation = forward((-1, 0, 1), offset, local, np.array([[5.0, 0.0, 0.0]]))
    np.testing.assert_allclose(position[0], [[5, 0, 0], [5, 1, 0], [4, 1, 0]], atol=1e-12)
    np.testing.assert_allclose(rotation[0, 2], quarter @ quarter @ quarter, atol=1e-12)


def test_offsets_may_change_from_frame_to_frame() -> None:
    local = np.tile(np.eye(3), (2, 2, 1, 1))
    offset = np.array([[[0.0, 0, 0], [0, 0, 1]], [[0, 0, 0], [0, 0, 2]]])
    position, _ = forward((-1, 0), offset, local, np.zeros((2, 3)))
    assert position[:, 1, 2].tolist() == [1.0, 2.0]


def test_what_is_no_usable_motion_is_one_line() -> None:
    assert validate(recording()).frames == 3 and recording().part(1, 3).frames == 2
    broken = recording().position.copy()
    broken[2, 1, 0] = np.nan
    for wrong, said in (
        (recording(1), r"walk: 1 frame\(s\); a transition needs at least 2"),
        (replace(recording(), fps=0.5), "walk: 0.5 frames a second; expected 1 to 1000"),
        (replace(recording(), fps=float("nan")), "walk: nan frames a second"),
        (replace(recording(), position=broken), "non-finite values, first in frame 2"),
        (replace(recording(), position=np.full_like(broken, -1e300)), "positions up to 1e\\+300"),
    ):
        with pytest.raises(ClipError, match=said):
            validate(wrong)
