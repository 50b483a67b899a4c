"""Quality measures of a clip: errors, skating, penetration, jerk, joint limits, discontinuities.

`before` is the recording: the ghost of a retargeted clip, else the clip itself. `after` is the
character's motion.
"""

import numpy as np
import torch
from torch import Tensor

from world.character import features, servos, soles
from world.character import model as character
from world.errors import ClipError
from world.motions.clip import Clip
from world.motions.fit import poses
from world.motions.objects import Skeleton

Array = np.ndarray

#: A foot's joint less than this above its lowest height stands on the floor, m.
CONTACT_M = 0.02
#: A foot that is faster than this swings, m/s.
CONTACT_M_S = 0.6
#: Accelerations beyond these, m/s² and rad/s², are breaks: people reach a third.
BREAK_M_S2, BREAK_RAD_S2 = 120.0, 900.0
#: Excess of a joint over its range that does not count, rad.
_LIMIT_SLACK_RAD = np.deg2rad(1.0)
_HANDS, _FEET = (5, 8), (11, 14)
#: The front of the sole, in the foot's frame, m.
_TOE = torch.tensor(soles.FRONT_M)
_KEY_ROLES = ("right_wrist", "left_wrist", "right_ankle", "left_ankle")


def followed(clip: Clip) -> tuple[Tensor, Tensor]:
    """World positions [T, 15, 3] m and rotations [T, 15, 3, 3] of the character at the clip's
    qpos."""
    from world import rotations
    from world.character import kinematics

    qpos = torch.from_numpy(clip.qpos())
    local = rotations.matrix(kinematics.local_rotations(qpos))
    return kinematics.forward(qpos[:, :3], local)


def ghost_roles(ghost: Skeleton) -> dict[str, int] | None:
    """Index of the ghost's joint by part of the body; None where its names are not recognised."""
    from world.motions.formats import landmarks

    try:
        return landmarks.among(ghost.names, ghost.parents, "ghost")
    except ClipError:
        return None


def key_body_error_m(clip: Clip) -> float:
    """Mean distance of hands and feet from the recorded ones, m.

    The recorded ones are the ghost's wrists and ankles, or without a ghost the clip's own bodies,
    from which the character's differ because its elbows and knees have one axis.
    """
    position, _ = followed(clip)
    ours = position[:, [*_HANDS, *_FEET]].numpy()
    roles = ghost_roles(clip.ghost) if clip.ghost else None
    if clip.ghost is not None and roles is not None:
        theirs = clip.ghost.position_m[:, [roles[role] for role in _KEY_ROLES]]
    else:
        theirs = poses.body_poses(clip)[0][:, [*_HANDS, *_FEET]].numpy()
    return float(np.linalg.norm(ours - theirs, axis=-1).mean())


def skates_m_s(clip: Clip) -> tuple[float, float]:
    """Mean slip of standing feet, m/s, of the recording and of the character; 0 if none stands.

    The recorded feet are the ghost's, or without a ghost the clip's own; they decide for both when
    a foot stands. Without recorded toes the ankles alone count.
    """
    position, rotation = poses.body_poses(clip)
    ankles = position[:, list(_FEET)]
    toes = ankles + (rotation[:, list(_FEET)] @ _TOE[:, None])[..., 0]
    ours = np.stack((ankles.numpy(), toes.numpy()))
    theirs = ours
    roles = ghost_roles(clip.ghost) if clip.ghost else None
    if clip.ghost is not None and roles is not None:
        joints = clip.ghost.position_m
        ankle = [roles["right_ankle"], roles["left_ankle"]]
        toe = [roles.get("right_toe", ankle[0]), roles.get("left_toe", ankle[1])]
        theirs = np.stack((joints[:, ankle], joints[:, toe]))
        if toe == ankle:
            ours = ours[[0, 0]]
    standing = stands(theirs, clip.fps)
    return slip_m_s(theirs, standing, clip.fps), slip_m_s(ours, standing, clip.fps)


def slips(ends: Array, fps: float) -> Array:
    """Horizontal speed [T − 1, 2] m/s of the slower of ankle and toes [2, T, 2, 3] m: a foot that
    rolls over its heel or toes does not slip."""
    return np.linalg.norm(np.diff(ends[..., :2], axis=1), axis=-1).min(axis=0) * fps


def stands(ends: Array, fps: float) -> Array:
    """Whether each foot stands between frames, [T − 1, 2] bool, by its ends [2, T, 2, 3] m.

    It stands while ankle or toes are within CONTACT_M of their height when flat (a low percentile)
    and one of them is slower than CONTACT_M_S, so that a low swing does not count.
    """
    low = np.percentile(ends[..., 2], 10, axis=(1, 2))
    down = np.any(ends[..., 2] < low[:, None, None] + CONTACT_M, axis=0)
    return np.logical_and.reduce((down[1:], down[:-1], slips(ends, fps) < CONTACT_M_S))


def slip_m_s(ends: Array, standing: Array, fps: float) -> float:
    """Mean slip of standing feet, m/s; 0 if none stands."""
    return float(slips(ends, fps)[standing].mean()) if standing.any() else 0.0


def penetration_m(clip: Clip) -> float:
    """Depth of the lowest point of the character's shapes below z = 0, m."""
    from world.motions.retarget.limits import shape_points

    bodies, points, radii = shape_points(character.spec().compile())
    position, rotation = followed(clip)
    index = torch.from_numpy(bodies - 1).long()
    up = rotation[:, index, 2]
    reach = (up * torch.from_numpy(points).float()).sum(-1) - torch.from_numpy(radii).float()
    return max(0.0, -float((position[:, index, 2] + reach).min()))


def jerk_m_s3(points: Array, fps: float) -> float:
    """Mean magnitude of the third derivative of points [T, n, 3], m/s³; 0 for fewer than 4
    frames."""
    if len(points) < 4:
        return 0.0
    return float(np.linalg.norm(np.diff(points, 3, axis=0), axis=-1).mean() * fps**3)


def jerks_m_s3(clip: Clip) -> tuple[float, float]:
    """Jerk of hands and feet, m/s³, of the recording and of the character."""
    ours = followed(clip)[0][:, [*_HANDS, *_FEET]].numpy()
    after = jerk_m_s3(ours, clip.fps)
    roles = ghost_roles(clip.ghost) if clip.ghost else None
    if clip.ghost is None or roles is None:
        return after, after
    theirs = clip.ghost.position_m[:, [roles[role] for role in _KEY_ROLES]]
    return jerk_m_s3(theirs, clip.fps), after


def past_limits(clip: Clip) -> tuple[float, float, str]:
    """Fraction of frames with a joint past its range, greatest excess (rad), and its joint."""
    low, high = character.set_point_bounds()
    angle = servos.coordinates(torch.from_numpy(clip.qpos())).numpy()
    excess = np.maximum(low - angle, angle - high)
    names = [
        f"{joint.name}_{'xyz'[axis]}" if joint.is_ball else joint.name
        for joint in character.JOINTS
        for axis in range(len(joint.range_deg))
    ]
    worst = int(excess.max(axis=0).argmax())
    fraction = float((excess > _LIMIT_SLACK_RAD).any(axis=1).mean())
    most = max(0.0, float(excess.max()))
    return fraction, most, names[worst] if most > _LIMIT_SLACK_RAD else ""


def discontinuities(clip: Clip) -> list[float]:
    """Times, s, of jumps of the velocities beyond a human body's; adjacent ones count once."""
    jump = np.abs(np.diff(clip.qvel().astype(np.float64), axis=0)) * clip.fps
    broken = (jump[:, :3] > BREAK_M_S2).any(1) | (jump[:, 3:] > BREAK_RAD_S2).any(1)
    frames = np.flatnonzero(broken)
    runs = np.split(frames, np.flatnonzero(np.diff(frames) > 3) + 1)
    # a jump between two frames appears in the velocities of both and of the adjacent ones
    return [round(float(run.mean() + 0.5) / clip.fps, 3) for run in runs if len(run)]


#: Hands and feet among the features' key bodies: what key_body_error_m is the mean of.
assert {character.BODIES[b] for b in (*_HANDS, *_FEET)} == set(features.KEY_BODIES)
