"""How well a clip fits the character: what its joints cannot do, skating, sinking, jumps, rests."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from world.motions import measures
from world.motions.clip import Clip
from world.motions.fit.bed import find_beds
from world.motions.fit.floor import floor_corrected, resampled
from world.motions.fit.seat import find_seats

#: What still trains well: beyond the first `fair`, beyond the second `poor`.
SKATE_M_S, ERROR_M, PENETRATION_M = (0.15, 0.4), (0.04, 0.08), (0.02, 0.05)


@dataclass(frozen=True)
class ClipReport:
    """One clip's line in `motions check --json`."""

    clip: str
    frames: int
    seconds: float
    key_body_error_m: float
    """Mean distance of hands and feet from the recorded ones, scaled to the character's legs."""
    foot_skate_before_m_s: float
    """Mean speed of standing feet, as the clip came."""
    foot_skate_after_m_s: float
    """The same of the character's."""
    penetration_m: float
    """Deepest point of the character below the floor."""
    discontinuities: list[float]
    """When the motion breaks, s."""
    verdict: str
    """good, fair or poor; refused where it cannot be read."""
    rests: list[dict[str, Any]]
    refused: str | None
    jerk_before_m_s3: float = 0.0
    """Mean jerk of hands and feet, as the clip came."""
    jerk_after_m_s3: float = 0.0
    past_limits: float = 0.0
    """Share of frames in which a joint is past its range by more than a degree."""
    past_limits_deg: float = 0.0
    """By how much at most."""
    past_limits_joint: str = ""
    """Which joint that is."""


def examine(clip: Clip) -> ClipReport:
    """The report of a clip that could be read."""
    ready = floor_corrected(resampled(clip))
    before, after = measures.skates_m_s(ready)
    error = measures.key_body_error_m(ready)
    sinks, breaks = measures.penetration_m(ready), measures.discontinuities(ready)
    jerk_before, jerk_after = measures.jerks_m_s3(ready)
    share, most, joint = measures.past_limits(ready)
    return ClipReport(
        clip=clip.name,
        frames=clip.frames,
        seconds=round(clip.seconds, 3),
        key_body_error_m=round(error, 4),
        foot_skate_before_m_s=round(before, 4),
        foot_skate_after_m_s=round(after, 4),
        penetration_m=round(sinks, 4),
        discontinuities=breaks,
        verdict=verdict(after, error, sinks, len(breaks)),
        rests=rests(ready),
        refused=None,
        jerk_before_m_s3=round(jerk_before, 1),
        jerk_after_m_s3=round(jerk_after, 1),
        past_limits=round(share, 4),
        past_limits_deg=round(float(np.rad2deg(most)), 2),
        past_limits_joint=joint,
    )


def verdict(skate_m_s: float, error_m: float, sinks_m: float, breaks: int) -> str:
    """good, fair or poor."""
    measured = ((skate_m_s, SKATE_M_S), (error_m, ERROR_M), (sinks_m, PENETRATION_M))
    if breaks > 2 or any(value > limits[1] for value, limits in measured):
        return "poor"
    if breaks or any(value > limits[0] for value, limits in measured):
        return "fair"
    return "good"


def refusal(name: str, reason: str) -> ClipReport:
    """The report of a file that cannot be read or does not fit."""
    return ClipReport(name, 0, 0.0, 0.0, 0.0, 0.0, 0.0, [], "refused", [], reason)


def rests(clip: Clip) -> list[dict[str, Any]]:
    """Where and when a clip sits and lies, in console.md's form."""
    beds = [clip.bed] if clip.bed else find_beds(clip)
    found, lies = find_seats(clip)
    seats = [clip.seat] if clip.seat else [] if lies else found
    lying = [rest(clip, "lie", b.from_frame, b.to_frame, b.hip_m, b.facing_rad) for b in beds]
    sitting = [rest(clip, "sit", s.from_frame, s.to_frame, s.point_m, s.facing_rad) for s in seats]
    return sorted(lying + sitting, key=lambda r: r["from_s"])


def rest(
    clip: Clip, kind: str, start: int, stop: int, point_m: tuple[float, ...], facing_rad: float
) -> dict[str, Any]:
    """One rest: where and when."""
    pelvis = clip.root_position_m[start:stop, 2]
    return {
        "kind": kind,
        "from_s": round(start / clip.fps, 3),
        "to_s": round(stop / clip.fps, 3),
        "pelvis_height_m": round(float(np.median(pelvis)), 4),
        "object_point_m": [round(float(x), 4) for x in point_m],
        "object_facing_deg": round(float(np.rad2deg(facing_rad)), 2),
    }
