"""The box of a clip, fitted to its hands: at rest before the grasp, rigid with the hands during the
hold, at rest after the release."""

from dataclasses import replace

import numpy as np
import torch

from world import rotations
from world.character import model as character
from world.errors import ClipError
from world.motions.clip import Clip
from world.motions.fit.poses import body_poses, smooth, stretches
from world.motions.formats import landmarks
from world.motions.objects import BoxTrack, Skeleton

#: Radius of the character's hands, m: the box is narrower than their distance by twice this.
HAND_M = 0.04
#: Half the thickness of a hand at its knuckles, m: the palms are that much nearer to each other.
_PALM_M = 0.006
#: Knuckles of the recorded skeleton by which a box is placed: between them are the palms.
_KNUCKLES = ("index", "middle", "ring")
#: A hold: hands this far apart, with a distance steady to this (standard deviation over _STEADY_S),
#: level to this, ahead of the pelvis by this; m and s.
_APART_M = (0.20, 0.85)
_STEADY_M, _STEADY_S = 0.012, 0.4
_LEVEL_M, _AHEAD_M = 0.2, 0.05
#: The line between the hands is square to the heading within this angle.
_ACROSS = np.cos(np.deg2rad(40.0))
#: In a hold the centre between the hands moves by at least this, m.
_CARRIED_M = 0.25
#: Swinging or resting hands are nearer to the pelvis than this, m. Further ahead, a hold lasts at
#: least the shorter time, s; nearer, it lasts at least the longer one, with the hands at most this
#: far apart, m, and the pelvis above this, m.
_HELD_AHEAD_M = 0.26
_SHORTEST_S = (0.8, 1.5)
_CLOSE_M = 0.42
_UP_M = 0.70
#: With the pelvis lower than this there is no hold, m.
_DOWN_M = 0.50
#: Gaps of the grip up to this are closed, s.
_GAP_S = 0.4
#: The hands are closed on the box when their distance is within this of its width, m.
_CLOSED_M = 0.015
#: Wrists that turn are further apart or nearer at the lowest point of a bend: a hold is extended to
#: there within this time, s, and this difference of their distance, m.
_TURNING_S, _TURNING_M = 1.2, 0.14
_ON_ITS_WAY_M_S = 0.15
#: From the pelvis to the near face of a carried box: at least the depth of the trunk, m.
_TRUNK_M = 0.13
#: Depth and height of a box, as fractions of its width: the paper's 30 × 50 × 35 cm, long side
#: across.
_DEPTH, _HEIGHT = 0.7, 0.6
#: The same where fingers are recorded: those of OMOMO's large box (0.335, 0.338, 0.360 m), the only
#: one known with its motion.
_DEPTH_TRACKED, _HEIGHT_TRACKED = 1.0, 1.05
#: Palms that close on a box between these heights, m, hold faces of a box on the floor: lower ones
#: reach below its edges, higher ones take it from a table.
_ON_FACES_M = (0.15, 0.45)


def find_box(clip: Clip) -> BoxTrack | None:
    """The track of a clip's box; None if its hands hold nothing.

    The box is level and square to the line between the hands. Its width is their distance less
    their thickness; depth and height have the paper's proportions. Where the recorded skeleton has
    fingers, the palms place the box; else the wrists do, which hold it at its near half.
    """
    position, _ = body_poses(clip)
    hands = [
        _smooth(position[:, body].numpy().astype(np.float64))
        for body in (character.BODIES.index(f"{side}_hand") for side in ("right", "left"))
    ]
    line = hands[1] - hands[0]
    apart = np.linalg.norm(line, axis=1)
    ahead = _ahead(clip, hands)
    middle = 0.5 * (hands[0] + hands[1])
    holds: list[tuple[int, int]] = []
    grips: list[tuple[int, int]] = []
    for start, stop in _filled(_gripping(clip, hands), round(_GAP_S * clip.fps)):
        grip = closed(apart, start, stop, clip.frames)
        if grip is not None and _holds(clip, apart, ahead, middle, slice(*grip)):
            grips.append(grip)
            holds.append(_from_the_bend(apart, middle[:, 2], *grip, clip.fps))
    if not holds:
        return None
    held = np.zeros(clip.frames, bool)
    for start, stop in holds:
        held[start:stop] = True
    palms = _palms(clip)
    thickness, depth, height = HAND_M, _DEPTH, _HEIGHT
    if palms is not None:
        # the height is the wrists': fingers reach down to the lower edges
        middle = np.column_stack((0.5 * (palms[0] + palms[1])[:, :2], middle[:, 2]))
        line, thickness = palms[1] - palms[0], _PALM_M
        depth, height = _DEPTH_TRACKED, _HEIGHT_TRACKED
        apart, ahead = np.linalg.norm(line, axis=1), _ahead(clip, palms)
    yaw = np.unwrap(np.arctan2(-line[:, 0], line[:, 1]))
    tilt = np.arcsin(np.clip(line[:, 2] / apart, -1, 1))
    width = float(np.median(apart[held])) - 2 * thickness
    size = (depth * width, width, height * width)
    if palms is not None:
        first = grips[0][0]
        tight = np.abs(apart - np.median(apart[held])) < _CLOSED_M
        palm_m = 0.5 * (palms[0] + palms[1])[first + int(tight[first:].argmax()), 2]
        if first > 0 and _ON_FACES_M[0] < palm_m < _ON_FACES_M[1]:
            # it stands on the floor when the palms close on its faces, and is rigid with them
            raised = palm_m - 0.5 * size[2]
            middle[:, 2] = 0.5 * (palms[0] + palms[1])[:, 2] - raised
    # wrists hold a box at its near half, and the trunk limits how near it is
    carried = held & (middle[:, 2] > clip.root_position_m[:, 2] - 0.1)
    near = float(np.median(ahead[carried if carried.any() else held]))
    offset = float(np.clip(_TRUNK_M + 0.5 * size[0] - near, 0.0, 0.5 * size[0]))
    if palms is not None:
        offset = 0.0
    centre = middle + offset * np.column_stack((np.cos(yaw), np.sin(yaw), np.zeros(clip.frames)))
    path = np.column_stack((centre, yaw, tilt))
    path = np.where(held[:, None], path, _resting(path, held))
    pose = np.concatenate((path[:, :3], _rotation(path[:, 3], path[:, 4])), axis=1)
    return BoxTrack(pose.astype(np.float32), size, held)


def _smooth(points: np.ndarray) -> np.ndarray:
    """Points [T, 3], smoothed over a few frames."""
    return np.stack([smooth(x, 1.0) for x in points.T], axis=1)


def _palms(clip: Clip) -> list[np.ndarray] | None:
    """Mean of the recorded knuckles [T, 3] m of the right and the left hand; None where the
    skeleton has no fingers."""
    if clip.ghost is None:
        return None
    ghost = clip.ghost
    try:
        joint = landmarks.among(ghost.names, ghost.parents, clip.name)
    except ClipError:
        return None
    palms = []
    for side in ("right", "left"):
        wrist = joint[f"{side}_wrist"]
        fingers: dict[str, int] = {}
        for index, name in enumerate(ghost.names):
            # the first joint of a finger: its metacarpal begins at the wrist
            finger = next((f for f in _KNUCKLES if f in name.lower()), "")
            if finger and "meta" not in name.lower() and _descends(ghost, index, wrist):
                fingers.setdefault(finger, index)
        if len(fingers) < len(_KNUCKLES):
            return None
        knuckles = ghost.position_m[:, list(fingers.values())].astype(np.float64).mean(axis=1)
        palms.append(_smooth(knuckles))
    return palms


def _descends(ghost: Skeleton, joint: int, above: int) -> bool:
    while joint >= 0 and joint != above:
        joint = ghost.parents[joint]
    return joint == above


def with_box(clip: Clip) -> list[Clip]:
    """The clip with its box, if any."""
    return [replace(clip, box=find_box(clip))]


def _gripping(clip: Clip, hands: list[np.ndarray]) -> np.ndarray:
    """[T] bool: the hands are posed as in a hold."""
    line = hands[1] - hands[0]
    apart = np.linalg.norm(line, axis=1)
    half = max(1, round(0.5 * _STEADY_S * clip.fps))
    windows = np.lib.stride_tricks.sliding_window_view(
        np.pad(apart, half, mode="edge"), 2 * half + 1
    )
    # steady on one side of the frame is enough, at the begin and end of a grip
    spread = windows.std(axis=1)
    before, after = np.roll(spread, half), np.roll(spread, -half)
    before[:half], after[len(after) - half :] = np.inf, np.inf
    steady = np.minimum(spread, np.minimum(before, after)) < _STEADY_M
    heading = rotations.heading(torch.from_numpy(clip.local_rotation[:, 0])).numpy()
    across = np.stack((-heading[:, 1], heading[:, 0]), axis=1)
    level = np.linalg.norm(line[:, :2], axis=1)
    square = np.sum(line[:, :2] * across, axis=1) > _ACROSS * level
    ahead = _ahead(clip, hands) > _AHEAD_M
    reach = (apart > _APART_M[0]) & (apart < _APART_M[1])
    return steady & square & ahead & reach & (np.abs(line[:, 2]) < _LEVEL_M)


def _ahead(clip: Clip, hands: list[np.ndarray]) -> np.ndarray:
    """[T]: distance of the centre between the hands ahead of the pelvis, m."""
    heading = rotations.heading(torch.from_numpy(clip.local_rotation[:, 0])).numpy()
    middle = 0.5 * (hands[0] + hands[1])
    return np.sum((middle - clip.root_position_m)[:, :2] * heading, axis=1)


def _filled(mask: np.ndarray, gap: int) -> list[tuple[int, int]]:
    """The stretches of a mask, merged where at most `gap` frames apart."""
    filled = mask.copy()
    for start, stop in stretches(~mask):
        if stop - start <= gap and start > 0 and stop < len(mask):
            filled[start:stop] = True
    return stretches(filled)


def closed(apart: np.ndarray, start: int, stop: int, frames: int) -> tuple[int, int] | None:
    """A hold, cut or extended to the frames in which the hands' distance is the box's width; None
    where there are none.
    """
    width = float(np.median(apart[start:stop]))
    tight = np.abs(apart - width) < _CLOSED_M
    middle = np.flatnonzero(tight[start:stop])
    if not len(middle):
        return None
    first, last = start + int(middle[0]), start + int(middle[-1])
    while first > 0 and tight[first - 1]:
        first -= 1
    while last < frames - 1 and tight[last + 1]:
        last += 1
    return first, last + 1


def _holds(
    clip: Clip, apart: np.ndarray, ahead: np.ndarray, middle: np.ndarray, grip: slice
) -> bool:
    """Whether hands at a constant distance hold something: they move, and are far ahead or stay so
    for long."""
    pelvis = float(np.median(clip.root_position_m[grip, 2]))
    if np.linalg.norm(np.ptp(middle[grip], axis=0)) < _CARRIED_M or pelvis < _DOWN_M:
        return False
    seconds = (grip.stop - grip.start) / clip.fps
    if float(np.median(ahead[grip])) > _HELD_AHEAD_M:
        return seconds >= _SHORTEST_S[0]
    return seconds >= _SHORTEST_S[1] and pelvis > _UP_M and float(np.median(apart[grip])) < _CLOSE_M


def _from_the_bend(
    apart: np.ndarray, height: np.ndarray, start: int, stop: int, fps: int
) -> tuple[int, int]:
    """A hold from the lowest position of the hands about its begin to the one about its end.

    It is extended to there where the hands only rise from the first and only fall to the second. It
    is cut where they come down to the first and rise from the second: hands that are as far apart
    as the box is wide, on their way to it or away from it, do not hold it.
    """
    reach = round(_TURNING_S * fps)
    width = float(np.median(apart[start:stop]))
    # hands are still when they close on a box: moving ones hold it already
    speed = np.gradient(height) * fps
    before = np.arange(max(0, start - reach), start + 1)
    lowest = int(before[np.argmin(height[before])])
    if (
        speed[start] > _ON_ITS_WAY_M_S
        and _only_rises(height[lowest : start + 1])
        and abs(apart[lowest] - width) < _TURNING_M
    ):
        start = lowest
    after = np.arange(stop - 1, min(len(height), stop + reach))
    lowest = int(after[np.argmin(height[after])])
    if (
        speed[stop - 1] < -_ON_ITS_WAY_M_S
        and _only_rises(height[stop - 1 : lowest + 1][::-1])
        and abs(apart[lowest] - width) < _TURNING_M
    ):
        stop = lowest + 1
    lowest = start + int(np.argmin(height[start : min(stop, start + reach)]))
    moving = start > 0 and speed[start] < -_ON_ITS_WAY_M_S
    if moving and _only_rises(height[start : lowest + 1][::-1]):
        start = lowest
    begin = max(start, stop - reach)
    lowest = begin + int(np.argmin(height[begin:stop]))
    moving = stop < len(height) and speed[stop - 1] > _ON_ITS_WAY_M_S
    if moving and _only_rises(height[lowest:stop]):
        stop = lowest + 1
    return start, stop


def _only_rises(height: np.ndarray) -> bool:
    """Whether heights rise by more than 5 cm and never fall by more than 1 cm."""
    climbed = np.maximum.accumulate(height)
    return bool(height[-1] - height[0] > 0.05 and (climbed - height).max() < 0.01)


def _resting(path: np.ndarray, held: np.ndarray) -> np.ndarray:
    """The path with the box at rest outside the holds: at its last release, or its first grasp."""
    rest = path.copy()
    holds = stretches(held)
    for start, stop in stretches(~held):
        after = [h for h in holds if h[0] >= stop]
        before = [h for h in holds if h[1] <= start]
        rest[start:stop] = path[before[-1][1] - 1] if before else path[after[0][0]]
    return rest


def _rotation(yaw: np.ndarray, tilt: np.ndarray) -> np.ndarray:
    """Quaternions [T, 4] of turns by `tilt` about x, then by `yaw` about z."""
    cy, sy, cx, sx = np.cos(yaw / 2), np.sin(yaw / 2), np.cos(tilt / 2), np.sin(tilt / 2)
    return np.stack((cy * cx, cy * sx, sy * sx, sy * cx), axis=1)
