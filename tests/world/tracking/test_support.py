"""Seats and beds made to fit clips."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.track_scenes import clips
from world.motions.synthetic.lies import lying
from world.tracking.support import AWAY_M, Support, sunk_m, support, supports


def top(found: Support) -> float:
    box = found.piece.boxes[0]
    return box.centre_m[2] + box.half_m[2]


def test_a_seat_is_as_high_as_the_pelvis_rests_and_nothing_runs_through_it() -> None:
    clip = clips()[2]
    assert clip.seat is not None
    found = support(clip)
    assert found.point_m == clip.seat.point_m
    assert top(found) == pytest.approx(clip.seat.point_m[2] - 0.01)
    # where it sits down and gets up it brushes an edge
    deep = sunk_m(clip, found)
    assert deep.max() < 0.05
    seated = slice(clip.seat.from_frame, clip.seat.to_frame)
    assert np.median(deep[seated]) < 0.015
    # were it as large as a table, the shins would run through it
    box = found.piece.boxes[0]
    table = replace(box, half_m=(0.6, 0.6, box.half_m[2]))
    wide = replace(found, piece=replace(found.piece, boxes=(table,)))
    assert sunk_m(clip, wide).max() > deep.max() + 0.02


def test_a_bed_lies_along_the_body() -> None:
    clip = lying(np.random.default_rng(1), 0.45, 1.5, 0.3, 1, head_left=True)
    assert clip.bed is not None
    found = support(clip)
    assert top(found) == pytest.approx(clip.bed.height_m - 0.01)
    x, y = np.subtract(clip.bed.head_m, clip.bed.hip_m)[:2]
    assert found.yaw_rad == pytest.approx(np.arctan2(y, x))
    reach = found.piece.boxes[0]
    assert reach.centre_m[0] + reach.half_m[0] > np.hypot(x, y)


def test_a_mirror_image_rests_on_the_image_of_what_its_clip_rests_on() -> None:
    own, image = supports(clips()[2:])
    assert image == own.mirrored()
    # within how finely edges are drawn in, it is what the image alone would have been given
    alone = support(clips()[3])
    assert image.origin_m == pytest.approx(alone.origin_m)
    assert image.yaw_rad == pytest.approx(alone.yaw_rad)
    for a, b in zip(image.piece.boxes, alone.piece.boxes, strict=True):
        assert a.half_m == pytest.approx(b.half_m, abs=0.021)
    assert np.allclose(sunk_m(clips()[2], own), sunk_m(clips()[3], image), atol=1e-4)


def test_a_box_needs_no_seat_and_a_walker_nothing() -> None:
    carried = clips()[0]
    for clip in (carried, replace(carried, box=None)):
        assert support(clip).origin_m == AWAY_M
