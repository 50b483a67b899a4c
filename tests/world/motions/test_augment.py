"""Clips at another pace."""

import numpy as np
import pytest

from world.motions import augment
from world.motions.clip import Clip
from world.motions.synthetic import library


def test_a_slower_clip_is_the_same_motion_slower(imported: Clip) -> None:
    slow = augment.at_speed(imported, 0.8)
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
    with pytest.raises(Exception, match=r"playback speed 2: choose 0\.8 to 1\.25"):
        augment.at_speed(imported, 2.0)


def test_pacing_keeps_the_seat_with_its_frames() -> None:
    clip = library.sitting(np.random.default_rng(0), 0.44, 1.5, 0.3, 1, back=True)
    assert clip.seat is not None
    seat = augment.at_speed(clip, 1.25).seat
    assert seat is not None
    assert seat.point_m == clip.seat.point_m
    assert seat.from_frame == pytest.approx(clip.seat.from_frame / 1.25, abs=1)
    assert seat.to_frame == pytest.approx(clip.seat.to_frame / 1.25, abs=1)
