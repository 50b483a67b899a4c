"""The seat of a clip is found where it was, and mocap rests on it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.samp_clips import needs_samp, prepared
from world.motions.clip import Clip, Seat
from world.motions.fit import poses, seat


def test_the_seat_is_found_where_the_clip_sat(sitting: Clip) -> None:
    known = sitting.seat
    assert known is not None
    found = seat.with_seats(replace(sitting, seat=None))[0].seat
    assert found is not None
    np.testing.assert_allclose(found.point_m, known.point_m, atol=0.02)
    turn = (found.facing_rad - known.facing_rad + np.pi) % (2 * np.pi) - np.pi
    assert abs(turn) < np.deg2rad(5)


@needs_samp
@pytest.mark.parametrize("name", ["armchair004", "chair_mo006", "chair_mo_sit2sit"])
def test_mocap_rests_on_its_inferred_seat(name: str) -> None:
    clip = prepared(name)
    assert isinstance(clip.seat, Seat)
    assert 0.35 < clip.seat.point_m[2] < 0.46
    position, rotation = poses.body_poses(clip)
    rest = slice(clip.seat.from_frame, clip.seat.to_frame)
    off = np.abs(poses.seat_clearance(position, rotation)[rest] - clip.seat.point_m[2])
    assert np.median(off) < 0.02
