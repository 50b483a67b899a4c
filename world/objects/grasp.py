"""Geometry of holding a box between two hands: grip, pose of the arms, state of the box."""

from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.character import kinematics
from world.character import model as character
from world.scene.target import BoxState

_BODY = character.BODIES.index
_TORSO = _BODY("torso")
#: Of each side, right first: the bodies of upper and lower arm, and the addresses in qpos of the
#: shoulder's quaternion and the elbow's angle.
_SIDES = tuple(
    (
        _BODY(f"{side}_upper_arm"),
        _BODY(f"{side}_lower_arm"),
        character.BALL_QPOS[ball],
        character.HINGE_QPOS[hinge],
    )
    for side, ball, hinge in (("right", 2, 0), ("left", 3, 1))
)
_SIGNS = (-1.0, 1.0)
_UPPER_M, _FORE_M, _HAND_M = 0.274788, 0.258947, 0.04
#: The near edge of a box in hand is this far before the root, its centre this far above it, m.
_BEFORE_M, _ABOVE_M = 0.16, 0.12
#: The hands hold a box at the centres of two faces, or this far from their near edges, m, where
#: that is nearer: the arms of an upright body reach no farther about a deep box.
HOLD_DEPTH_M = 0.175


@dataclass(frozen=True)
class Grip:
    """The two faces on which the hands hold the box."""

    axis: Tensor
    """[n, 3]: horizontal unit vector from the box's centre to the left hand's face."""
    out_m: Tensor
    """[n]: distance from the centre to the centre of a hand in contact."""
    nearer: Tensor
    """[n, 3]: offset of the holds from the faces' centres, towards the body, m."""


def held_centre(root: Tensor, heading: Tensor, depth_m: Tensor) -> Tensor:
    """[n, 3]: centre of a box in hand, m, for root [n, 3] m, heading [n, 2] and depth_m [n], from
    its centre to its edge along the heading."""
    ahead = root[:, :2] + (_BEFORE_M + depth_m)[:, None] * heading
    return torch.cat((ahead, root[:, 2:] + _ABOVE_M), dim=1)


def holding_pose(qpos: Tensor, box: BoxState) -> Tensor:
    """qpos [n, 43] with the arms bent so that the hands hold the box on both sides, or are as near
    as the arms reach."""
    position, rotation, goals = _holds(qpos, box)
    found = qpos.clone()
    for side, (upper, lower, ball, hinge) in enumerate(_SIDES):
        bent = _arm_angles(position, rotation, goals[side], _SIGNS[side], upper, lower)
        found[:, ball : ball + 4] = rotations.from_rotation_vector(bent[:, :3]).to(found)
        found[:, hinge] = bent[:, 3].to(found)
    return found


def stretch(qpos: Tensor, box: BoxState) -> Tensor:
    """[n, 2]: distance from shoulder to hold, right first, in lengths of the arm; beyond 1 the arm
    does not reach it."""
    position, _, goals = _holds(qpos, box)
    shoulders = (position[:, side[0]] for side in _SIDES)
    apart = [(goal - shoulder).norm(dim=1) for goal, shoulder in zip(goals, shoulders, strict=True)]
    return torch.stack(apart, dim=1) / (_UPPER_M + _FORE_M)


def _holds(qpos: Tensor, box: BoxState) -> tuple[Tensor, Tensor, list[Tensor]]:
    """Positions and rotations of the bodies, and the place of each hand, right first, [n, 3], m."""
    position, rotation = kinematics.forward(
        qpos[:, :3], rotations.matrix(kinematics.local_rotations(qpos))
    )
    grip = grip_of(box, rotations.heading(qpos[:, 3:7]))
    middle, out = box.position + grip.nearer, grip.axis * grip.out_m[:, None]
    return position, rotation, [middle + sign * out for sign in _SIGNS]


def grip_of(box: BoxState, heading: Tensor) -> Grip:
    """The two opposite upright faces whose normals are nearest to square to the heading [n, 2]."""
    axes = rotations.matrix(box.rotation)[:, :, :2]
    left = torch.stack((-heading[:, 1], heading[:, 0]), dim=1)
    along = (axes[:, :2] * left[..., None]).sum(dim=1)
    chosen = along.abs().argmax(dim=1)
    rows = torch.arange(len(chosen), device=chosen.device)
    sign = torch.where(along[rows, chosen] < 0, -1.0, 1.0)
    ahead = axes[rows, :, 1 - chosen]
    back = torch.where((ahead[:, :2] * heading).sum(dim=1) < 0, 1.0, -1.0)
    back = back * hold_play_m(box.half[rows, 1 - chosen])
    return Grip(
        axes[rows, :, chosen] * sign[:, None],
        box.half[rows, chosen] + _HAND_M,
        ahead * back[:, None],
    )


def hold_play_m(half_depth_m: Tensor) -> Tensor:
    """Distance of a hold from its face's centre, m, for half the depth of the face, m."""
    return (half_depth_m - HOLD_DEPTH_M).clamp_min(0.0)


def half_depth_m(box: BoxState, heading: Tensor) -> Tensor:
    """[n]: distance from the box's centre to its edge along a heading [n, 2], m."""
    axes = rotations.matrix(box.rotation)[:, :2, :2]
    return ((axes * heading[..., None]).sum(dim=1).abs() * box.half[:, :2]).sum(dim=1)


def _arm_angles(
    position: Tensor, rotation: Tensor, goal: Tensor, sign: float, upper: int, lower: int
) -> Tensor:
    """[n, 4]: rotation vector of the shoulder and angle of the elbow, rad, that bring the hand to
    `goal` [n, 3] or as near as the arm reaches. The elbow points outward and down."""
    torso = rotation[:, _TORSO]
    there = ((goal - position[:, upper])[:, None] @ torso)[:, 0]
    far = there.norm(dim=1).clamp(0.12, 0.995 * (_UPPER_M + _FORE_M))
    cosine = (far.square() - _UPPER_M**2 - _FORE_M**2) / (2 * _UPPER_M * _FORE_M)
    bent = torch.acos(cosine.clamp(-1.0, 1.0))
    zero = torch.zeros_like(bent)
    # in the frame of the upper arm: the hand, and the elbow's offset from the line to it
    hand = torch.stack((_FORE_M * bent.sin(), zero, -_UPPER_M - _FORE_M * bent.cos()), dim=1)
    elbow = torch.stack((zero, zero, zero - _UPPER_M), dim=1)
    down = there.new_tensor((-0.3, 0.5 * sign, -1.0))
    now = ((position[:, lower] - position[:, upper])[:, None] @ torso)[:, 0]
    wanted, own = _frame(there, now + down), _frame(hand, elbow)
    shoulder = rotations.to_rotation_vector(rotations.from_matrix(wanted @ own.transpose(1, 2)))
    return torch.cat((shoulder, bent[:, None]), dim=1)


def _frame(along: Tensor, beside: Tensor) -> Tensor:
    """[n, 3, 3]: columns along [n, 3], the part of `beside` [n, 3] across it, and their product."""
    x = along / along.norm(dim=1, keepdim=True).clamp_min(1e-6)
    y = beside - (beside * x).sum(dim=1, keepdim=True) * x
    y = y / y.norm(dim=1, keepdim=True).clamp_min(1e-6)
    return torch.stack((x, y, torch.linalg.cross(x, y)), dim=2)
