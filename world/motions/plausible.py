"""Whether a motion can be a person's: gait, speeds, heights and proportions.

A rate, unit, axis or joint map that is wrong gives a motion that the other measures call good. Each
check compares two quantities that a person ties together, so that the message can say what would
make them agree. Sizes are those of the character (legs of 0.83 m).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from world.character import model as character
from world.errors import ClipError
from world.motions.clip import Clip
from world.motions.fit import poses
from world.motions.fit.poses import smooth
from world.motions.formats import landmarks

Array = np.ndarray
Points = Mapping[str, Array]
"""Positions [T, 3] m, z up, floor at 0, by part of the body (landmarks.ROLES)."""

#: A step: the ankles pass each other by this along the heading, m.
_PASSED_M = 0.1
#: A walk: at least so many steps, each within this factor of the median time.
_STEPS, _EVEN = 2, 2.2
#: Steps from which the length is known well enough to judge the rate.
_SURE_STEPS = 4
#: The steps are found on a curve through the points at this multiple of their rate: steps at four
#: times a person's are three points apart at 30 Hz.
_FINER = 4
#: Step length over step frequency, m s: people keep it at all speeds of walking (Sekiya et al.
#: 1996, "The invariant relationship between step length and step rate during free walking").
#: Median of 150 walks of CMU, ACCAD and SAMP by `longest_walk`, which measures between the ankles.
WALK_RATIO_MS = 0.34
#: A walk is at another rate where it is beyond these multiples of human step frequency.
_FAST, _SLOW = 1.6, 0.45
#: Walkers step no more often than this, and no person more often than the second, Hz.
_WALK_HZ, _MOST_HZ = 2.9, 5.2
#: Nor more slowly than this with steps of this length, Hz, m.
_LEAST_HZ, _LONG_M = 0.8, 0.4
#: Travel over the length of the steps: walkers do not fly, runners do.
_WALKS, _TRAVEL = 1.3, 3.0
#: Walks on the spot: at less of the steps' speed than the first over as many steps as the second.
_ON_THE_SPOT = ((0.2, 6), (0.05, 3))
#: Least step length of a walk whose travel is judged, m.
_STRIDES_M = 0.25
#: Greatest sustained speed of the pelvis, and of hands and feet relative to it, m/s.
_PELVIS_M_S, _LIMB_M_S = 9.0, 11.0
#: The pelvis falls no faster than freely: greatest share of frames beyond this, m/s².
_FALL_M_S2, _FALL_SHARE = 20.0, 0.08
#: Greatest height of the pelvis above the floor, m: on a ladder or a bar.
_HIGH_M = 2.6
#: Least and greatest length relative to another: thigh to shin, upper arm to lower, arm to leg,
#: trunk to leg, one side to the other.
_THIGH, _UPPER_ARM, _ARM, _TRUNK, _SIDES = (0.6, 1.7), (0.45, 3.0), (0.4, 1.1), (0.3, 1.1), 1.3
#: Greatest change of a bone's length, as a fraction of it.
_STRETCH = 0.3
_RATES_HZ = (15, 30, 60, 120, 240, 480, 960)
_FACTORS = {"cm": 100.0, "mm": 1000.0, "in": 1 / 0.0254, "ft": 1 / 0.3048}


@dataclass(frozen=True)
class Walk:
    """The longest regular walk of a motion."""

    steps: int
    hz: float
    """Steps per second."""
    step_m: float
    """Mean distance of the ankles along the heading at double support."""
    speed_m_s: float
    """Speed of the pelvis over the floor."""
    ahead_m_s: float
    """The part of it along the heading: who steps sideways hardly passes one foot by the other."""

    @property
    def rate_factor(self) -> float:
        """Step frequency relative to a person's at this length of step."""
        return WALK_RATIO_MS * self.hz / self.step_m

    @property
    def travel_factor(self) -> float:
        """Speed along the heading relative to that of the steps."""
        return self.ahead_m_s / (self.hz * self.step_m)


def implausible(clip: Clip, fps: float | None = None, stated: bool = False) -> str:
    """Why a clip cannot be a person's motion, with the likely cause; empty where it can.

    Args:
        fps: rate of the source, frames per second, for the hint; the clip's by default.
        stated: whether the file itself states this rate.
    """
    points = points_of(clip)
    if points is None:
        return ""
    return judged(points, clip.fps, fps or clip.fps, stated)


def points_of(clip: Clip) -> Points | None:
    """The recorded joints of a clip, or its own bodies; None where its ghost's are not known."""
    if clip.ghost is None:
        position = poses.body_poses(clip)[0].numpy().astype(np.float64)
        return {role: position[:, body] for role, body in _own().items()}
    try:
        joint = landmarks.among(clip.ghost.names, clip.ghost.parents, clip.name)
    except ClipError:
        return None
    position = clip.ghost.position_m.astype(np.float64)
    return {role: position[:, index] for role, index in joint.items()}


def _own() -> dict[str, int]:
    names = {"hip": "thigh", "knee": "shin", "ankle": "foot", "shoulder": "upper_arm",
             "elbow": "lower_arm", "wrist": "hand"}  # fmt: skip
    return {
        "head": character.BODIES.index("head"),
        **{
            f"{side}_{part}": character.BODIES.index(f"{side}_{body}")
            for side in landmarks.SIDES
            for part, body in names.items()
        },
    }


def judged(points: Points, fps: float, source_fps: float, stated: bool = False) -> str:
    """Why points at `fps` cannot be a person's; empty where they can."""
    for check in (_proportions, _axis, _sides):
        found = check(points, fps)
        if found:
            return found
    walk = longest_walk(points, fps)
    return (walk and _gait(walk, source_fps, stated)) or _speeds(points, fps)


def _pelvis(points: Points) -> Array:
    return 0.5 * (points["left_hip"] + points["right_hip"])


def _ahead(points: Points) -> Array:
    """Unit vectors [T, 2]: the heading of the hips."""
    left = (points["left_hip"] - points["right_hip"])[:, :2]
    ahead = np.stack((left[:, 1], -left[:, 0]), axis=1)
    return ahead / np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)


def longest_walk(points: Points, fps: float) -> Walk | None:
    """The longest run of regular steps; None where there are fewer than two."""
    apart = np.sum((points["left_ankle"] - points["right_ankle"])[:, :2] * _ahead(points), axis=1)
    if len(apart) < _STEPS + 2:
        return None
    at = np.linspace(0, len(apart) - 1, _FINER * (len(apart) - 1) + 1)
    apart = CubicSpline(np.arange(len(apart)), apart)(at)
    fps *= _FINER
    sign, turns = 0, []
    for frame, value in enumerate(apart):
        if abs(value) > _PASSED_M and np.sign(value) != sign:
            sign = int(np.sign(value))
            turns.append(frame)
    if len(turns) <= _STEPS:
        return None
    # the first and the last step may be half ones
    lasts = np.diff(turns)
    best = (0, 0)
    start = 0
    for end in range(1, len(lasts) + 1):
        while end - start > 1 and (
            lasts[start:end].max() > _EVEN * np.median(lasts[start:end])
            or lasts[start:end].min() * _EVEN < np.median(lasts[start:end])
        ):
            start += 1
        best = max(best, (end - start, start))
    count, start = best
    if count < _STEPS:
        return None
    first, last = turns[start], turns[start + count]
    length = [
        float(np.abs(apart[a:b]).max())
        for a, b in zip(turns[start : start + count], turns[start + 1 :], strict=False)
    ]
    seconds = (last - first) / fps
    here = slice(first // _FINER, -(-last // _FINER) + 1)
    moved = np.diff(_pelvis(points)[here, :2], axis=0) * fps / _FINER
    ahead = np.abs(np.sum(moved * _ahead(points)[here][:-1], axis=1))
    return Walk(
        count,
        count / seconds,
        float(np.mean(length)),
        float(np.linalg.norm(moved, axis=1).mean()),
        float(ahead.mean()),
    )


def _gait(walk: Walk, source_fps: float, stated: bool) -> str:
    """What is wrong with a walk: its travel, or its rate."""
    speed = f"{walk.speed_m_s:.{0 if walk.speed_m_s > 10 else 1}f}"
    said = f"{walk.hz:.1f} steps of {walk.step_m:.2f} m a second at {speed} m/s"
    far = walk.step_m > _STRIDES_M
    if far and walk.travel_factor > _TRAVEL:
        factor = walk.travel_factor
        unit = min(_FACTORS, key=lambda name: abs(np.log(_FACTORS[name] / factor)))
        if factor > 2 * _TRAVEL:
            return f"{said}: is its travel in {unit}? (--unit {unit})"
        return f"{said}: the travel does not fit the steps"
    travelled = walk.speed_m_s / (walk.hz * walk.step_m)
    if far and any(travelled < least and walk.steps >= steps for least, steps in _ON_THE_SPOT):
        return f"{said}: it walks on the spot; is the travel of the root lost, or in another unit?"
    factor = walk.rate_factor
    sure = walk.steps >= _SURE_STEPS
    walks = sure and walk.travel_factor < _WALKS and walk.hz > _WALK_HZ
    fast = far and factor > _FAST and (walks or walk.hz > _MOST_HZ)
    slow = sure and walk.hz < _LEAST_HZ and factor < _SLOW and walk.step_m > _LONG_M
    if fast or slow:
        true = source_fps / factor
        rate = min(_RATES_HZ, key=lambda one: abs(np.log(one / true)))
        if stated:  # the file is seldom wrong: a dance steps so, too
            return f"{said} at the {source_fps:g} fps that the file states (--fps {rate} overrides)"
        return f"{said}: is it at {rate} fps? (--fps {rate})"
    return ""


def _speeds(points: Points, fps: float) -> str:
    """Heights and speeds that no person reaches."""
    pelvis = _pelvis(points)
    high = float(np.percentile(pelvis[:, 2], 90))
    if high > _HIGH_M:
        return f"the pelvis is {high:.1f} m above the floor: is its unit right? (--unit)"
    if len(pelvis) < 6:
        return ""
    smoothed = np.stack([smooth(x, min(0.06 * fps, len(x) / 8)) for x in pelvis.T], axis=1)
    velocity = np.gradient(smoothed, axis=0) * fps
    speed = float(np.percentile(np.linalg.norm(velocity[:, :2], axis=1), 75))
    if speed > _PELVIS_M_S:
        return f"the pelvis moves at {speed:.1f} m/s: are rate and unit right? (--fps, --unit)"
    limbs = max(
        float(np.percentile(
            np.linalg.norm(np.gradient(points[role] - pelvis, axis=0), axis=1) * fps, 75
        ))
        for role in ("left_wrist", "right_wrist", "left_ankle", "right_ankle")
    )  # fmt: skip
    if limbs > _LIMB_M_S:
        return f"hands or feet move at {limbs:.0f} m/s: is its rate lower? (--fps)"
    falls = -np.gradient(velocity[:, 2]) * fps > _FALL_M_S2
    if falls.mean() > _FALL_SHARE:
        return (
            f"the pelvis falls faster than freely in {100 * falls.mean():.0f} % of the frames: is"
            " its rate lower? (--fps)"
        )
    return ""


def _proportions(points: Points, fps: float) -> str:
    """Bones that are no person's: another joint than the map says, or bones that stretch."""
    del fps
    bones: dict[str, Array] = {}
    for side in landmarks.SIDES:
        for name, upper, lower in (("thigh", "hip", "knee"), ("shin", "knee", "ankle"),
                                   ("upper arm", "shoulder", "elbow"),
                                   ("lower arm", "elbow", "wrist")):  # fmt: skip
            span = points[f"{side}_{lower}"] - points[f"{side}_{upper}"]
            bones[f"{side} {name}"] = np.linalg.norm(span, axis=-1)
    length = {name: float(np.median(bone)) for name, bone in bones.items()}
    for name, bone in bones.items():
        low, high = np.percentile(bone, (5, 95))
        if not length[name] > 1e-3 or high - low > _STRETCH * length[name]:
            return f"the {name} is {low:.2f} to {high:.2f} m long: are these its joints? (--map)"
    shoulders = 0.5 * (points["left_shoulder"] + points["right_shoulder"])
    trunk = float(np.median(np.linalg.norm(shoulders - _pelvis(points), axis=-1)))
    pairs = [
        ("trunk", "left leg", trunk, length["left thigh"] + length["left shin"], _TRUNK),
    ]
    for side in landmarks.SIDES:
        thigh, shin = length[f"{side} thigh"], length[f"{side} shin"]
        upper, lower = length[f"{side} upper arm"], length[f"{side} lower arm"]
        pairs += [
            (f"{side} thigh", "shin", thigh, shin, _THIGH),
            (f"{side} upper arm", "lower arm", upper, lower, _UPPER_ARM),
            (f"{side} arm", "leg", upper + lower, thigh + shin, _ARM),
        ]
    for name in ("thigh", "shin", "upper arm", "lower arm"):
        sides = (1 / _SIDES, _SIDES)
        right, left = length[f"right {name}"], length[f"left {name}"]
        pairs.append((f"right {name}", f"left {name}", right, left, sides))
    for name, other, one, two, (least, most) in pairs:
        if not least <= one / two <= most:
            return (
                f"{name} of {one:.2f} m and {other} of {two:.2f} m are no person's: are these its"
                " joints? (--map)"
            )
    return ""


def _axis(points: Points, fps: float) -> str:
    """A body that travels at length along the floor: the upward axis is another."""
    pelvis = _pelvis(points)
    leg = np.linalg.norm(points["left_hip"] - points["left_ankle"], axis=-1)
    most = np.linalg.norm(points["left_hip"] - points["left_knee"], axis=-1) + np.linalg.norm(
        points["left_knee"] - points["left_ankle"], axis=-1
    )
    body = points["head"] - 0.5 * (points["left_ankle"] + points["right_ankle"])
    along = np.abs(body[:, 2]) / np.maximum(np.linalg.norm(body, axis=-1), 1e-9)
    lies = (along < 0.4) & (leg > 0.85 * most)
    if len(pelvis) < 2 or lies.mean() < 0.5:
        return ""
    travel = np.linalg.norm(np.ptp(pelvis, axis=0))
    seconds = len(pelvis) / fps
    if travel > 0.6 and travel / seconds > 0.25:
        return (
            f"the body lies straight and travels {travel:.1f} m: is another axis upward? (--up y or"
            " --up z)"
        )
    return ""


def _sides(points: Points, fps: float) -> str:
    """Knees that bend ahead of the hips: right and left are exchanged."""
    del fps
    left = points["left_hip"] - points["right_hip"]
    bends: list[Array] = []
    for side in landmarks.SIDES:
        thigh = points[f"{side}_knee"] - points[f"{side}_hip"]
        shin = points[f"{side}_ankle"] - points[f"{side}_knee"]
        normal = np.cross(shin, thigh)
        size = np.linalg.norm(thigh, axis=-1) * np.linalg.norm(shin, axis=-1)
        across = np.sum(normal * left, axis=-1) / np.maximum(
            size * np.linalg.norm(left, axis=-1), 1e-9
        )
        bends.append(across[np.linalg.norm(normal, axis=-1) > 0.4 * size])
    bent = np.concatenate(bends)
    if len(bent) >= 6 and (bent > 0).mean() > 0.9:
        return "the knees bend forward: are right and left exchanged? (--map)"
    return ""
