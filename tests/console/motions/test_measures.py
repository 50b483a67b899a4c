"""How well a clip fits: verdicts at their limits, and rests where the clip sits."""

import pytest

from console.motions import measures
from world.motions import load


def test_verdicts_at_their_limits() -> None:
    assert measures.verdict(0.15, 0.04, 0.02, 0) == "good"
    assert measures.verdict(0.16, 0.0, 0.0, 0) == measures.verdict(0.0, 0.0, 0.0, 1) == "fair"
    assert measures.verdict(0.0, 0.0, 0.051, 0) == measures.verdict(0.0, 0.0, 0.0, 3) == "poor"


def test_an_own_clip_is_good_and_rests_on_its_seat() -> None:
    clip = next(clip for clip in load.own_clips() if clip.seat is not None)
    report = measures.examine(clip)
    assert report.verdict == "good" and report.refused is None and not report.discontinuities
    assert report.seconds == pytest.approx(clip.seconds, abs=1e-3)
    (rest,) = report.rests
    assert rest["kind"] == "sit" and rest["object_point_m"] == pytest.approx(
        clip.seat.point_m, abs=1e-3
    )
    assert rest["to_s"] - rest["from_s"] == pytest.approx(
        (clip.seat.to_frame - clip.seat.from_frame) / clip.fps, abs=1e-2
    )
    assert rest["pelvis_height_m"] > clip.seat.point_m[2]
