"""Track: follow a clip, with the box, seat or bed that it uses.

The reward compares body, joints, velocities, root, box and the hands' contacts with the reference
(after DeepMimic and InterMimic). An episode ends where the character deviates from the reference,
or loses a box that the reference holds.
"""

from typing import ClassVar

import torch
from torch import Tensor

from world import rotations
from world.affordances import REFERENCE
from world.character import features
from world.character.features import Body, Feature, Table
from world.character.model import BODIES, JOINTS, NU
from world.scene.target import BoxState, Target
from world.tasks.task import Task
from world.tracking.target import HAND_M, HANDS, TOUCH_M, TrackTarget, deviation, gap_m, tracked

#: Numbers of control steps by which the goal shows the reference ahead.
AHEAD = (1, 4, 10)
#: Bodies whose positions the goal shows.
KEY_BODIES = ("head", "torso", "right_hand", "left_hand", "right_foot", "left_foot")
_KEYS = [BODIES.index(name) for name in KEY_BODIES]
#: Deviations that end an episode: rms of the bodies relative to the root, the root horizontally,
#: its height, the box; m. And the number of control steps without a grip that ends it.
BODY_M, ROOT_M, HEIGHT_M, BOX_M, GRIP_STEPS = 0.30, 0.70, 0.30, 0.30, 10
_FRAME = "root heading"


def _goal() -> Table:
    found = []
    for k in AHEAD:
        later = f"the reference {k} control steps ahead"
        found += [
            Feature(f"{b}_in_{k}", 3, _FRAME, "m", meaning=f"{b} of {later}, from its root")
            for b in KEY_BODIES
        ]
        found += [
            Feature(f"root_in_{k}", 3, _FRAME, "m", meaning=f"root of {later}, from the root"),
            Feature(f"heading_in_{k}", 2, _FRAME, "cosine and sine", meaning=f"heading of {later}"),
            Feature(
                f"box_in_{k}",
                3,
                _FRAME,
                "m",
                meaning=f"box of {later}: from the root, while held from the reference's; 0: none",
            ),
            Feature(f"box_axes_in_{k}", 6, _FRAME, "", meaning=f"x and z axes of its box; {later}"),
            Feature(f"right_grip_in_{k}", 1, "", "0 or 1", meaning=f"{later} holds the box"),
            Feature(f"left_grip_in_{k}", 1, "", "0 or 1", meaning=f"{later} holds the box"),
        ]
    grip = "from the hand to the middle of its face of the box"
    return Table(
        "goal",
        *found,
        Feature(
            "setpoint_error",
            NU,
            "joint",
            "rad",
            meaning="the reference's next set-points less the joint coordinates",
        ),
        Feature("right_reach", 3, _FRAME, "m", meaning=grip),
        Feature("left_reach", 3, _FRAME, "m", meaning=grip),
        *(Feature(f"box_half_{a}", 1, "box", "m", meaning="half edge of the box") for a in "xyz"),
        Feature("box_mass", 1, "", "kg", meaning="mass of the box"),
    )


class Track(Task):
    """The track task."""

    name = "track"
    affordance = REFERENCE
    goal = _goal()
    terms: ClassVar[dict[str, float]] = {
        "body": 0.20,
        "joint": 0.05,
        "velocity": 0.05,
        "root": 0.30,
        "box": 0.25,
        "box_angle": 0.05,
        "contact": 0.10,
    }
    stages: ClassVar[tuple[str, ...]] = ("end_body", "end_root", "end_box", "end_grip")
    success_m = BODY_M

    def goal_features(self, body: Body, target: Target) -> Tensor:
        target = tracked(target)
        reference, heading = target.reference, body.heading
        boxed = target.boxed()[:, None].float()
        # all frames at once, [n, K, ...]: an operation on so few scenes costs the same for each
        last = reference.stop[reference.clip[target.frame]] - 1
        frame = torch.minimum(target.frame[:, None] + torch.tensor(AHEAD), last[:, None])
        position, held = reference.position[frame], reference.held[frame][..., None]
        keys = position[:, :, _KEYS] - position[:, :, :1]
        origin, here = target.origin[:, None], body.root[:, None]
        root = position[:, :, 0] + origin
        # as the deviation is measured: a held box from the root, a resting one in the world
        drift = torch.where(held, root - here, 0.0)
        box = reference.box[frame]
        there = box[..., :3] + origin - drift
        axes = rotations.matrix(box[..., 3:])
        world = torch.cat((keys, (root - here)[:, :, None]), dim=2)
        of_box = torch.stack((there - here, axes[..., 0], axes[..., 2]), dim=2)
        ahead = (
            rotations.turn_back(heading[:, None, None], world).flatten(2),
            rotations.turn_back(heading[:, None], reference.heading[frame]),
            boxed[..., None] * rotations.turn_back(heading[:, None, None], of_box).flatten(2),
            held.float().expand(-1, -1, 2),
        )
        parts = [torch.cat(ahead, dim=2).flatten(1)]
        following = reference.ahead(target.frame, 1)
        parts.append(reference.set_point[following] - joint_coordinates(body))
        if target.box is None:
            parts.append(torch.zeros(len(boxed), 10))
        else:
            reach = rotations.turn_back(heading[:, None], _reach(body, target.box)).flatten(1)
            parts.append(boxed * torch.cat((reach, target.box.half, target.mass[:, None]), dim=1))
        return torch.cat(parts, dim=1)

    def reward_terms(self, body: Body, target: Target) -> Tensor:
        target = tracked(target)
        reference, frame = target.reference, target.frame
        off = deviation(body, target)
        near = torch.exp(-15.0 * off.body.square())
        joint = joint_coordinates(body) - reference.coordinates[frame]
        joint = torch.exp(-3.0 * joint.square().sum(dim=1))
        rate = body.features[:, _VELOCITY] - reference.qvel[frame, 6:]
        drift = body.root_velocity - reference.qvel[frame, :3]
        speed = torch.exp(-0.1 * rate.square().mean(dim=1) - drift.square().sum(dim=1))
        turned = 1.0 - (body.heading * reference.heading[frame]).sum(dim=1)
        # a broad slope that leads back, and a narrow one: hands reach a box from the right place
        drifted = off.root.square()
        place = 0.5 * torch.exp(-4.0 * drifted) + 0.5 * torch.exp(-30.0 * drifted)
        root = place * torch.exp(-4.0 * off.height.square() - 4.0 * turned)
        terms = [near, joint, speed, root]
        if target.box is None:
            terms += [near, joint, near]
        else:
            boxed = target.boxed()
            box = torch.exp(-15.0 * off.box.square())
            angle = torch.exp(-2.0 * _angle(target, frame).square())
            terms += [
                torch.where(boxed, box, near),
                torch.where(boxed, angle, joint),
                torch.where(boxed, _contact(body, target), near),
            ]
        return torch.stack(terms, dim=1)

    def error_m(self, body: Body, target: Target) -> Tensor:
        """[n]: rms of the bodies relative to the root, or the box's deviation where that is more,
        m."""
        off = deviation(body, tracked(target))
        return torch.maximum(off.body, off.box)

    def stage(self, body: Body, target: Target) -> Tensor:
        return torch.stack(self._ends(body, tracked(target)), dim=1)

    def low(self, body: Body, target: Target) -> Tensor:
        return torch.ones_like(body.root[:, 2], dtype=torch.bool)

    def fell(self, body: Body, target: Target) -> Tensor:
        """[n] bool: the character deviates, or lost the box."""
        return torch.stack(self._ends(body, tracked(target)), dim=1).any(dim=1)

    def _ends(self, body: Body, target: TrackTarget) -> list[Tensor]:
        off = deviation(body, target)
        astray = (off.root > ROOT_M) | (off.height > HEIGHT_M)
        lost = (off.box > BOX_M) if target.box is not None else torch.zeros_like(astray)
        return [off.body > BODY_M, astray, lost, target.lost >= GRIP_STEPS]


_VELOCITY = features.STATE.slice("joint_velocity")
_ROTATIONS = [
    features.STATE.slice(f"rotation_{joint.name}").start + i
    for joint in JOINTS
    if joint.is_ball
    for i in range(6)
]
_ANGLES = [
    features.STATE.slice(f"angle_{joint.name}").start for joint in JOINTS if not joint.is_ball
]


def _order() -> Tensor:
    """Where each servo's coordinate stands in (vectors of all balls, angles of all hinges)."""
    balls, hinges, found = 0, 3 * sum(joint.is_ball for joint in JOINTS), []
    for joint in JOINTS:
        if joint.is_ball:
            found += range(balls, balls + 3)
            balls += 3
        else:
            found.append(hinges)
            hinges += 1
    return torch.tensor(found)


_ORDER = _order()


def joint_coordinates(body: Body) -> Tensor:
    """[n, 28]: the joints as the servos measure them, rad, from the body's features."""
    axes = body.features[:, _ROTATIONS].view(-1, len(_ROTATIONS) // 6, 2, 3)
    x, z = axes[:, :, 0], axes[:, :, 1]
    whole = torch.stack((x, torch.linalg.cross(z, x), z), dim=-1)
    vectors = rotations.to_rotation_vector(rotations.from_matrix(whole))
    return torch.cat((vectors.flatten(1), body.features[:, _ANGLES]), dim=1)[:, _ORDER]


def _reach(body: Body, box: BoxState) -> Tensor:
    """[n, 2, 3]: from each hand to the middle of its face of the box, world axes, m: the right hand
    holds the face at −y."""
    side = torch.tensor((-1.0, 1.0))
    y = rotations.matrix(box.rotation)[..., 1]
    reach = (box.half[:, 1] + HAND_M)[:, None] * side
    grip = box.position[:, None] + reach[..., None] * y[:, None]
    return grip - body.position[:, HANDS]


def _contact(body: Body, target: TrackTarget) -> Tensor:
    """[n]: half for hands near the box, half for both on it, where the reference holds it; 1
    elsewhere."""
    assert target.box is not None
    gap = gap_m(body, target.box)
    near = torch.exp(-(gap.clamp_min(0.0) / 0.1).square()).mean(dim=1)
    both = (gap < TOUCH_M).all(dim=1).float()
    return torch.where(target.holds(), 0.5 * near + 0.5 * both, 1.0)


def _angle(target: TrackTarget, frame: Tensor) -> Tensor:
    """[n]: between the box's rotation and the reference's, rad."""
    assert target.box is not None
    dot = (target.box.rotation * target.reference.box[frame, 3:]).sum(dim=1).abs()
    return 2.0 * torch.acos(dot.clamp_max(1.0))
