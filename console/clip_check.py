"""How well a clip fits the character: what its joints cannot do, skating, sinking, jumps, rests."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from world import features
from world.motions import fit
from world.motions.clip import Clip
from world.motions.library import prepare

#: A sole lower than this, m, is on the floor and ought not to move.
CONTACT_M = 0.02
#: Accelerations beyond these, m/s^2 and rad/s^2, are breaks: people reach a third.
BREAK_M_S2, BREAK_RAD_S2 = 120.0, 900.0
#: What still trains well: beyond the first `fair`, beyond the second `poor`.
SKATE_M_S, ERROR_M = (0.15, 0.4), (0.03, 0.08)


@dataclass(frozen=True)
class ClipReport:
    """One clip's line in `motions check --json`."""

    clip: str
    frames: int
    seconds: float
    key_body_error_m: float
    """Mean distance of hands and feet from the clip's, because elbows and knees have one axis."""
    foot_skate_before_m_s: float
    """Mean speed of soles on the floor, as the clip came."""
    foot_skate_after_m_s: float
    """The same at 30 Hz on the mended floor."""
    penetration_m: float
    """Deepest point of a sole below the mended floor."""
    discontinuities: list[float]
    """When the motion breaks, s."""
    verdict: str
    """good, fair or poor; refused where it is not used at all."""
    rests: list[dict[str, Any]]
    refused: str | None


def examine(clip: Clip) -> ClipReport:
    """The report of a raw clip that could be read."""
    before = skate_m_s(clip)
    mended = fit.floor_mended(fit.resampled(clip))
    after, error = skate_m_s(mended), key_body_error_m(mended)
    breaks = discontinuities(mended)
    rests, lies = fit.find_seats(mended)
    refused = None if prepare(clip) else "lies down: of no use for sit"
    poor = after > SKATE_M_S[1] or error > ERROR_M[1] or len(breaks) > 2
    fair = after > SKATE_M_S[0] or error > ERROR_M[0] or bool(breaks)
    verdict = "refused" if refused else "poor" if poor else "fair" if fair else "good"
    return ClipReport(
        clip.name,
        clip.frames,
        round(clip.seconds, 3),
        round(error, 4),
        round(before, 4),
        round(after, 4),
        round(penetration_m(mended), 4),
        breaks,
        verdict,
        [] if lies else [rest(mended, seat) for seat in rests],
        refused,
    )


def refusal(name: str, reason: str) -> ClipReport:
    """The report of a file that cannot be read or does not fit."""
    return ClipReport(name, 0, 0.0, 0.0, 0.0, 0.0, 0.0, [], "refused", [], reason)


def rest(clip: Clip, seat: fit.Seat) -> dict[str, Any]:
    """Where and when a clip sits, in console.md's form."""
    pelvis = clip.root_position_m[seat.from_frame : seat.to_frame, 2]
    return {
        "kind": "sit",
        "from_s": round(seat.from_frame / clip.fps, 3),
        "to_s": round(seat.to_frame / clip.fps, 3),
        "pelvis_height_m": round(float(np.median(pelvis)), 4),
        "object_point_m": [round(x, 4) for x in seat.point_m],
        "object_facing_deg": round(float(np.rad2deg(seat.facing_rad)), 2),
    }


def skate_m_s(clip: Clip) -> float:
    """Mean horizontal speed of the ankles while their soles are on the floor; 0 if never."""
    position, rotation = fit.body_poses(clip)
    low = fit.sole_heights(position, rotation) < CONTACT_M + _floor(position, rotation)
    feet = position[:, [11, 14], :2].numpy()
    speed = np.linalg.norm(np.diff(feet, axis=0), axis=-1) * clip.fps
    planted = low[1:] & low[:-1]
    return float(speed[planted].mean()) if planted.any() else 0.0


def _floor(position: torch.Tensor, rotation: torch.Tensor) -> float:
    """Height of the floor that a clip stands on, m: the fifth percentile of its soles."""
    return float(np.percentile(fit.sole_heights(position, rotation).min(axis=1), 5))


def penetration_m(clip: Clip) -> float:
    """Deepest point of a sole below z = 0."""
    position, rotation = fit.body_poses(clip)
    return max(0.0, -float(fit.sole_heights(position, rotation).min()))


def key_body_error_m(clip: Clip) -> float:
    """Mean distance between hands and feet of the clip and of the character that follows it."""
    position, _ = fit.body_poses(clip)
    qpos = torch.from_numpy(clip.qpos())
    ours = features.body(qpos, torch.zeros(len(qpos), 34)).position
    ends = [5, 8, 11, 14]
    return float((ours[:, ends] - position[:, ends]).norm(dim=-1).mean())


def discontinuities(clip: Clip) -> list[float]:
    """Times, s, at which velocities jump as no body does; neighbouring ones once."""
    jump = np.abs(np.diff(clip.qvel().astype(np.float64), axis=0)) * clip.fps
    broken = (jump[:, :3] > BREAK_M_S2).any(1) | (jump[:, 3:] > BREAK_RAD_S2).any(1)
    frames = np.flatnonzero(broken)
    first = frames[np.diff(frames, prepend=-10) > 3]
    return [round(float(f) / clip.fps, 3) for f in first]
