"""Variants of a clip with a box: other stands, other sizes.

Who picks a box up from the floor passes every posture between bent and upright twice. A pick-up
from a stand of height h is spliced of these: down to where the hands have the height of the box on
that stand, a short bridge, and up from there. To put it down is the same in reverse. The arms are
solved for the hands to hold the box, which may have another size; a larger one is held higher, so
that the arms are bent. (As clips are adapted to other
boxes in OmniRetarget and ResMimic, whose solvers move the whole body.)
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from world import rotations
from world.character import features, kinematics
from world.character import model as character
from world.motions.clip import Clip, continuous_bodies, generalised_positions
from world.motions.objects import BoxTrack
from world.motions.synthetic.timing import minimum_jerk
from world.objects import grasp
from world.scene.target import BoxState

_HANDS = [character.BODIES.index(f"{side}_hand") for side in ("right", "left")]
_ARMS = [
    character.BODIES.index(f"{side}_{part}_arm")
    for side in ("right", "left")
    for part in ("upper", "lower")
]
#: Greatest speed of a joint in a bridge, rad/s, its fewest and most frames.
_BRIDGE_RAD_S, _BRIDGE = 2.5, (8, 24)
#: Frames in which the hands come to a box that is not raised, and leave it.
_REACH = 14
#: Hands that are this far below their highest, m, in so many frames before they hold the box, are
#: on their way down to it.
_DOWN_M, _BEFORE = 0.02, 60
#: The arms that hold a box larger than the clip's own are stretched to at most this fraction of
#: their length in this fraction of the frames: straight arms cannot press. It is raised for that in
#: such steps up to the last, m.
_STRETCHED, _MOSTLY, _RAISE_M, _RAISED_M = 0.92, 0.9, 0.01, 0.25
#: The hands are this much farther apart before they close on the box, m.
_OPEN_M = 0.08


@dataclass(frozen=True)
class _Splice:
    """Frames of the clip about a pick-up (or, in reverse, putting down)."""

    away: int
    """The last frame without the box."""
    held: int
    """The first frame with it."""
    frames: int
    """Number of frames between these."""


def variant(clip: Clip, stand_m: float, size: float | Sequence[float]) -> Clip | None:
    """Return a clip with its box picked up from, and put down on, stands of this height, m, and
    with a box of `size` times its own, or of these times its own edges.

    A stand that is lower than the clip's own leaves the height as it is; a box that is in hand
    throughout has no stand. None for a clip without a box or with several holds, and where the box
    is never raised to that height.
    """
    box = clip.box
    if box is None or not box.held.any():
        return None
    held = np.flatnonzero(box.held)
    first, last = int(held[0]), int(held[-1])
    if last - first >= len(held):
        return None
    factors = np.broadcast_to(np.asarray(size, np.float64), 3)
    edges = np.asarray(box.size_m) * factors
    pose = _grown(box, edges)
    if factors.max() > 1.0:
        pose[:, 2] += _raise_m(clip, pose, edges)
    rest_m = stand_m + 0.5 * edges[2]
    hands = _hands_m(clip) + (pose[:, 2] - box.pose[:, 2])
    frames = _Frames(clip.fps, continuous_bodies(clip.local_rotation), pose[:, 2], hands)
    pick = put = None
    if first > 0:
        pick = _pick(frames, first, last, rest_m)
        if pick is None:
            return None
    if last + 1 < clip.frames:
        final = clip.frames - 1
        put = _pick(frames.reversed(), final - last, final - first, rest_m)
        if put is None:
            return None
    stood = "" if pick is None and put is None else f"~{stand_m:.2f}m"
    sized = "x".join(dict.fromkeys(f"{factor:.2f}" for factor in factors))
    return _spliced(clip, pose, edges, pick, put, f"{clip.name}{stood}~x{sized}")


def _grown(box: BoxTrack, edges: np.ndarray) -> np.ndarray:
    """Poses [T, 7] of a box with other edges, whose near face and underside are where they were."""
    pose = box.pose.astype(np.float64).copy()
    more = 0.5 * (edges - np.asarray(box.size_m))
    ahead = rotations.matrix(torch.from_numpy(pose[:, 3:]))[:, :, 0].numpy()
    pose[:, :3] += more[0] * ahead * np.array([1.0, 1.0, 0.0]) + np.array([0.0, 0.0, more[2]])
    return pose


def _raise_m(clip: Clip, pose: np.ndarray, edges: np.ndarray) -> float:
    """How much higher than at `pose` [T, 7] a box is held, m, for the arms to be bent."""
    assert clip.box is not None
    held = torch.from_numpy(clip.box.held)
    qpos = torch.from_numpy(clip.qpos()).double()[held]
    track = torch.from_numpy(pose)[held]
    for step in range(round(_RAISED_M / _RAISE_M) + 1):
        stretched = grasp.stretch(qpos, _box_at(track, torch.from_numpy(edges)))
        if float(stretched.amax(dim=1).quantile(_MOSTLY)) <= _STRETCHED:
            return _RAISE_M * step
        track[:, 2] += _RAISE_M
    return _RAISED_M


def _box_at(track: torch.Tensor, edges: torch.Tensor) -> BoxState:
    """A box at poses [T, 7], with edges [3] or [T, 3], m."""
    position, rotation = track[:, :3], track[:, 3:]
    half = (0.5 * edges).expand(len(track), 3)
    return BoxState(position, rotation, torch.zeros_like(position), half, position, position)


def _hands_m(clip: Clip) -> np.ndarray:
    """Mean height [T] of the hands, m."""
    qpos = torch.from_numpy(clip.qpos())
    body = features.body(qpos, torch.zeros(len(qpos), character.NV))
    return body.position[:, _HANDS, 2].mean(dim=1).double().numpy()


@dataclass(frozen=True)
class _Frames:
    """What decides where a clip is spliced."""

    fps: int
    turns: np.ndarray
    """[T, 15, 4]: rotations of the bodies."""
    box_m: np.ndarray
    """[T]: height of the box's centre, m."""
    hands_m: np.ndarray
    """[T]: mean height of the hands that hold it, m."""

    def reversed(self) -> "_Frames":
        """The frames from the last to the first."""
        return _Frames(self.fps, self.turns[::-1], self.box_m[::-1], self.hands_m[::-1])


def _pick(frames: _Frames, first: int, last: int, rest_m: float) -> _Splice | None:
    """Return where a pick-up is spliced, for a box held from `first` to `last`; None where it is
    never that high."""
    lifted = np.flatnonzero(frames.box_m[first : last + 1] >= rest_m)
    if not len(lifted):
        return None
    grip = first + int(lifted[0])
    if grip == first:
        away = max(0, grip - _REACH)
    else:
        # hands hang lower than a box on a high stand: then from where they begin to go down
        hanging = frames.hands_m[max(0, first - _BEFORE) : first].max() - _DOWN_M
        level = min(frames.hands_m[grip], hanging)
        away = int(np.flatnonzero(frames.hands_m[:first] >= level)[-1])
    dot = np.abs((frames.turns[away] * frames.turns[grip]).sum(axis=-1)).clip(0.0, 1.0)
    apart = float((2.0 * np.arccos(dot)).max())
    bridge = int(np.clip(np.ceil(frames.fps * apart / _BRIDGE_RAD_S), *_BRIDGE))
    return _Splice(away, grip, bridge)


def _spliced(
    clip: Clip,
    pose: np.ndarray,
    edges: np.ndarray,
    pick: _Splice | None,
    put: _Splice | None,
    name: str,
) -> Clip:
    """Return the clip of the spliced frames."""
    assert clip.box is not None
    final = clip.frames - 1
    begin = 0 if pick is None else pick.held
    end = final if put is None else final - put.held
    end = max(end, begin)
    # (frame before, frame after, fraction) of each new frame; where the hands are on the way, the
    # fraction of it that is done
    rows: list[tuple[int, int, float]] = []
    closing: list[float] = []
    spot: list[int] = []
    if pick is not None:
        rows += [(t, t, 0.0) for t in range(pick.away + 1)]
        closing += [0.0] * (pick.away + 1)
        way = (np.arange(pick.frames) + 1.0) / (pick.frames + 1.0)
        rows += [(pick.away, pick.held, float(minimum_jerk(w))) for w in way]
        closing += way.tolist()
        spot += [begin] * (pick.away + 1 + pick.frames)
    rows += [(t, t, 0.0) for t in range(begin, end + 1)]
    closing += [1.0] * (end + 1 - begin)
    spot += range(begin, end + 1)
    if put is not None:
        leaves = final - put.away
        way = (np.arange(put.frames) + 1.0) / (put.frames + 1.0)
        rows += [(end, leaves, float(minimum_jerk(w))) for w in way]
        closing += (1.0 - way).tolist()
        rows += [(t, t, 0.0) for t in range(leaves, clip.frames)]
        closing += [0.0] * (clip.frames - leaves)
        spot += [end] * (put.frames + clip.frames - leaves)
    before, after, share = (np.array(column) for column in zip(*rows, strict=True))
    turns = continuous_bodies(clip.local_rotation)
    root = clip.root_position_m.astype(np.float64)
    root = root[before] + share[:, None] * (root[after] - root[before])
    local = _between(turns[before], turns[after], share)
    track = pose[np.array(spot)]
    done = np.array(closing)
    local = _with_arms(root, local, track, edges, done)
    return replace(
        clip,
        name=name,
        root_position_m=root.astype(np.float32),
        local_rotation=local.astype(np.float32),
        box=BoxTrack(track.astype(np.float32), tuple(edges.tolist()), done == 1.0),
        ghost=None,
    )


def _between(first: np.ndarray, second: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Rotations [T, B, 4] at fractions `share` [T] of the ways from one to another."""
    a, b = torch.from_numpy(first), torch.from_numpy(second)
    turn = rotations.to_rotation_vector(rotations.multiply(rotations.conjugate(a), b))
    part = torch.from_numpy(share)[:, None, None] * turn
    return rotations.normalise(rotations.multiply(a, rotations.from_rotation_vector(part))).numpy()


def _with_arms(
    root: np.ndarray, local: np.ndarray, track: np.ndarray, edges: np.ndarray, done: np.ndarray
) -> np.ndarray:
    """Rotations [T, B, 4] with the arms solved for the hands to close on the box and hold it."""
    qpos = torch.from_numpy(generalised_positions(root.astype(np.float32), local)).double()
    # first the hands come beside the box, then they close
    wide = torch.from_numpy(_OPEN_M * (1.0 - minimum_jerk(2.0 * done - 1.0)))
    opened = torch.from_numpy(edges).expand(len(root), 3).clone()
    opened[:, 1] += 2.0 * wide
    holding = _box_at(torch.from_numpy(track), opened)
    solved = kinematics.local_rotations(grasp.holding_pose(qpos, holding)).numpy()
    found = local.copy()
    reach = minimum_jerk(2.0 * done)
    found[:, _ARMS] = _between(local[:, _ARMS], solved[:, _ARMS], reach)
    return found
