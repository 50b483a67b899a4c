"""Measures of how well a clip fits the character: joint limits, skating, penetration,
discontinuities, rests."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from world.motions import measures, plausible
from world.motions.clip import Clip
from world.motions.fit.bed import find_beds
from world.motions.fit.floor import floor_corrected, resampled
from world.motions.fit.seat import find_seats

#: Limits of the verdicts: `fair` beyond the first, `poor` beyond the second.
SKATE_M_S, ERROR_M, PENETRATION_M = (0.15, 0.4), (0.04, 0.08), (0.02, 0.05)


@dataclass(frozen=True)
class ClipReport:
    """The row of a clip in `motions check --json`."""

    clip: str
    frames: int
    seconds: float
    key_body_error_m: float
    """Mean distance of hands and feet from the recorded ones, scaled to the character's legs."""
    foot_skate_before_m_s: float
    """Mean speed of standing feet in the source, m/s."""
    foot_skate_after_m_s: float
    """The same of the character, m/s."""
    penetration_m: float
    """Greatest depth of the character below the floor, m."""
    discontinuities: list[float]
    """Times of discontinuities, s."""
    verdict: str
    """good, fair or poor; implausible for no person's motion, refused for an unreadable clip."""
    rests: list[dict[str, Any]]
    refused: str | None
    jerk_before_m_s3: float = 0.0
    """Mean jerk of hands and feet in the source, m/s³."""
    jerk_after_m_s3: float = 0.0
    """The same of the character, m/s³."""
    past_limits: float = 0.0
    """Fraction of the frames with a joint beyond its range by more than a degree."""
    past_limits_deg: float = 0.0
    """Greatest excess over a joint range, degrees."""
    past_limits_joint: str = ""
    """Joint with the greatest excess."""
    implausible: str = ""
    """Why the motion cannot be a person's, and the likely cause; empty where it can."""


def examine(clip: Clip, source_fps: float | None = None, rate_stated: bool = False) -> ClipReport:
    """Return the report of a readable clip.

    source_fps: the rate of its source, if another. rate_stated: whether the file itself states it.
    """
    ready = floor_corrected(resampled(clip))
    before, after = measures.skates_m_s(ready)
    error = measures.key_body_error_m(ready)
    sinks, breaks = measures.penetration_m(ready), measures.discontinuities(ready)
    jerk_before, jerk_after = measures.jerks_m_s3(ready)
    share, most, joint = measures.past_limits(ready)
    why = plausible.implausible(ready, source_fps or clip.fps, rate_stated)
    return ClipReport(
        clip=clip.name,
        frames=clip.frames,
        seconds=round(clip.seconds, 3),
        key_body_error_m=round(error, 4),
        foot_skate_before_m_s=round(before, 4),
        foot_skate_after_m_s=round(after, 4),
        penetration_m=round(sinks, 4),
        discontinuities=breaks,
        verdict="implausible" if why else verdict(after, error, sinks, len(breaks)),
        rests=rests(ready),
        refused=None,
        jerk_before_m_s3=round(jerk_before, 1),
        jerk_after_m_s3=round(jerk_after, 1),
        past_limits=round(share, 4),
        past_limits_deg=round(float(np.rad2deg(most)), 2),
        past_limits_joint=joint,
        implausible=why,
    )


def verdict(skate_m_s: float, error_m: float, sinks_m: float, breaks: int) -> str:
    """Return good, fair or poor."""
    measured = ((skate_m_s, SKATE_M_S), (error_m, ERROR_M), (sinks_m, PENETRATION_M))
    if breaks > 2 or any(value > limits[1] for value, limits in measured):
        return "poor"
    if breaks or any(value > limits[0] for value, limits in measured):
        return "fair"
    return "good"


def refusal(name: str, reason: str) -> ClipReport:
    """Return the report of a refused file."""
    return ClipReport(name, 0, 0.0, 0.0, 0.0, 0.0, 0.0, [], "refused", [], reason)


def rests(clip: Clip) -> list[dict[str, Any]]:
    """Return the rests of a clip, sitting and lying, as JSON values."""
    beds = [clip.bed] if clip.bed else find_beds(clip)
    found, lies = find_seats(clip)
    seats = [clip.seat] if clip.seat else [] if lies else found
    lying = [rest(clip, "lie", b.from_frame, b.to_frame, b.hip_m, b.facing_rad) for b in beds]
    sitting = [rest(clip, "sit", s.from_frame, s.to_frame, s.point_m, s.facing_rad) for s in seats]
    return sorted(lying + sitting, key=lambda r: r["from_s"])


def rest(
    clip: Clip, kind: str, start: int, stop: int, point_m: tuple[float, ...], facing_rad: float
) -> dict[str, Any]:
    """Return one rest as JSON values; start and stop: frames."""
    pelvis = clip.root_position_m[start:stop, 2]
    return {
        "kind": kind,
        "from_s": round(start / clip.fps, 3),
        "to_s": round(stop / clip.fps, 3),
        "pelvis_height_m": round(float(np.median(pelvis)), 4),
        "object_point_m": [round(float(x), 4) for x in point_m],
        "object_facing_deg": round(float(np.rad2deg(facing_rad)), 2),
    }
