"""Floor and seat of a clip: found, mended, and true of mocap."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.samp_clips import needs_samp, prepared
from world.motions.clip import Clip, Seat
from world.motions.fit import ground


def test_resampling_keeps_the_motion(sitting: Clip) -> None:
    doubled = ground.resampled(sitting, 60)
    again = ground.resampled(doubled, 30)
    frames = min(again.frames, sitting.frames)
    np.testing.assert_allclose(
        again.root_position_m[:frames], sitting.root_position_m[:frames], atol=1e-5
    )
    dot = np.abs((again.local_rotation[:frames] * sitting.local_rotation[:frames]).sum(-1))
    np.testing.assert_allclose(dot, 1.0, atol=1e-4)


def test_a_drifting_floor_is_mended(sitting: Clip) -> None:
    drift = 0.04 * np.sin(np.linspace(0, 3, sitting.frames)) - 0.05
    moved = replace(
        sitting,
        root_position_m=sitting.root_position_m + drift[:, None].astype(np.float32) * [0, 0, 1],
    )
    mended = ground.floor_corrected(
        replace(moved, root_position_m=moved.root_position_m.astype("f4"))
    )
    error = mended.root_position_m[:, 2] - sitting.root_position_m[:, 2]
    assert np.abs(error).max() < 0.02


def test_the_seat_is_found_where_the_clip_sat(sitting: Clip) -> None:
    known = sitting.seat
    assert known is not None
    found = ground.with_seats(replace(sitting, seat=None))[0].seat
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
    position, rotation = ground.body_poses(clip)
    rest = slice(clip.seat.from_frame, clip.seat.to_frame)
    off = np.abs(ground.seat_clearance(position, rotation)[rest] - clip.seat.point_m[2])
    assert np.median(off) < 0.02


@needs_samp
@pytest.mark.parametrize("name", ["armchair004", "chair_mo006", "locomotion_random"])
def test_mocap_walks_on_the_floor(name: str) -> None:
    clip = prepared(name)
    position, rotation = ground.body_poses(clip)
    lowest = ground.sole_heights(position, rotation).min(axis=1)
    speed = np.linalg.norm(np.gradient(clip.root_position_m[:, :2], axis=0), axis=1) * clip.fps
    walking = (clip.root_position_m[:, 2] > 0.72) & (speed > 0.3)
    assert walking.sum() > 100
    assert np.percentile(np.abs(lowest[walking]), 95) < 0.02
