"""Track: follow a clip, with the box, seat or bed that it uses.

Reward: how near the body, the joints, their velocities, the root and the box are to those of the
reference, and hands on the box where the reference's are (after DeepMimic and InterMimic). An
episode ends where the character deviates, or loses a box that the reference holds.
"""

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar, cast

import torch
from torch import Tensor

from world import rotations
from world.character import features
from world.character.features import Body, Feature, Table
from world.character.model import BODIES, JOINTS, NU
from world.tasks.task import Affordance, BoxState, Place, Task

if TYPE_CHECKING:
    from world.motions.reference import Reference

#: The goal shows the reference so many control steps ahead.
AHEAD = (1, 4, 10)
#: Bodies whose positions it shows.
KEY_BODIES = ("head", "torso", "right_hand", "left_hand", "right_foot", "left_foot")
_KEYS = [BODIES.index(name) for name in KEY_BODIES]
_HANDS = [BODIES.index("right_hand"), BODIES.index("left_hand")]
_HAND_M, _TOUCH_M = 0.04, 0.02
#: Deviations that end an episode: rms of the bodies relative to the root, the root horizontally,
#: its height, the box; m. And control steps for which the grip may be lost.
BODY_M, ROOT_M, HEIGHT_M, BOX_M, GRIP_STEPS = 0.30, 0.70, 0.30, 0.30, 10
_FRAME = "root heading"


def _goal() -> Table:
    found = []
    for k in AHEAD:
        found += [
            Feature(f"{b}_in_{k}", 3, _FRAME, "m, from the reference root") for b in KEY_BODIES
        ]
        found += [
            Feature(f"root_in_{k}", 3, _FRAME, "m, from the root"),
            Feature(f"heading_in_{k}", 2, _FRAME, "cosine and sine"),
            Feature(f"box_in_{k}", 3, _FRAME, "m, from the root; held: from the reference's"),
            Feature(f"box_axes_in_{k}", 6, _FRAME, "x and z axes"),
            Feature(f"right_grip_in_{k}", 1, "", "1: the hand holds the box"),
            Feature(f"left_grip_in_{k}", 1, "", "1: the hand holds the box"),
        ]
    return Table(
        "goal",
        *found,
        Feature("setpoint_error", NU, "joint", "rad"),
        Feature("right_reach", 3, _FRAME, "m, from the hand to where it holds the box"),
        Feature("left_reach", 3, _FRAME, "m, from the hand to where it holds the box"),
        *(Feature(f"box_half_{axis}", 1, "box", "m") for axis in "xyz"),
        Feature("box_mass", 1, "", "kg"),
    )


@dataclass(frozen=True)
class TrackPlace(Place):
    """What n scenes follow, and how far they are."""

    reference: "Reference" = field(kw_only=True)
    residual: bool = field(kw_only=True)
    """Whether actions are added to the reference's set-points."""
    frame: Tensor = field(kw_only=True)
    """[n] int64: the reference's frame at this moment."""
    origin: Tensor = field(kw_only=True)
    """[n, 3]: from the clips' worlds to the scenes', m."""
    lost: Tensor = field(kw_only=True)
    """[n] int64: control steps for which the grip has been lost."""
    mass: Tensor = field(kw_only=True)
    """[n]: of the box, kg."""

    def rows(self, ids: Tensor) -> "TrackPlace":
        mine: dict[str, Any] = {name: value[ids] for name, value in self._own().items()}
        base = super().rows(ids)
        common: dict[str, Any] = {f.name: getattr(base, f.name) for f in fields(Place)}
        return TrackPlace(**common, reference=self.reference, residual=self.residual, **mine)

    def tensors(self) -> dict[str, Tensor]:
        return super().tensors() | self._own()

    def _own(self) -> dict[str, Tensor]:
        return {
            "frame": self.frame,
            "origin": self.origin,
            "lost": self.lost,
            "mass": self.mass,
        }

    def setpoints(self) -> Tensor | None:
        """[n, 28] rad: what actions are added to; None: the mean pose."""
        if not self.residual:
            return None
        return self.reference.setpoint[self.reference.ahead(self.frame, 1)]

    def advance(self, body: Body) -> None:
        self.frame.copy_(self.reference.ahead(self.frame, 1))
        missing = self.holds() & ~touching(body, self).all(dim=1)
        self.lost.copy_(torch.where(missing, self.lost + 1, 0))

    def told(self) -> dict[str, Tensor]:
        return {"segment": self.reference.segment[self.frame]}

    def over(self) -> Tensor:
        return self.frame >= self.reference.stop[self.clip()] - 1

    def clip(self) -> Tensor:
        """[n] int64: the clip that each scene follows."""
        return self.reference.clip[self.frame]

    def boxed(self) -> Tensor:
        """[n] bool: whether it has a box."""
        return self.reference.boxed[self.clip()]

    def holds(self) -> Tensor:
        """[n] bool: whether the reference holds it now."""
        return self.reference.held[self.frame]

    def object_features(self, body: Body) -> Tensor:
        around = features.object_features(body.root, body.heading, self.floor_point(), self.facing)
        if self.box is None:
            return around
        posed = super().object_features(body)
        return torch.where(self.boxed()[:, None], posed, around)


@dataclass(frozen=True)
class Deviation:
    """How far n scenes are from their references, m, rad and s."""

    body: Tensor
    """[n]: rms over the bodies of their positions relative to the root, world axes."""
    root: Tensor
    """[n]: of the root, horizontally."""
    height: Tensor
    """[n]: of its height."""
    box: Tensor
    """[n]: of the box from where it should be: while the reference holds it relative to the root,
    else in the world; 0 where there is none."""


def deviation(body: Body, place: TrackPlace) -> Deviation:
    """How far the scenes are from their references at this moment."""
    reference, frame = place.reference, place.frame
    theirs = reference.position[frame]
    relative = (body.position - body.root[:, None]) - (theirs - theirs[:, :1])
    squared = relative[:, 1:].square().sum(dim=2).mean(dim=1)
    root = theirs[:, 0] + place.origin - body.root
    box = torch.zeros_like(squared)
    if place.box is not None:
        there = reference.box[frame, :3] + place.origin
        off = (place.box.position - there) + torch.where(place.holds()[:, None], root, 0.0)
        box = torch.where(place.boxed(), off.norm(dim=1), 0.0)
    return Deviation(squared.sqrt(), root[:, :2].norm(dim=1), root[:, 2].abs(), box)


class Track:
    """The track task."""

    name = "track"
    # of no one kind of object: each clip brings what it uses
    affordance: Affordance = cast("Affordance", "any")
    episode_s = 10.0
    goal = _goal()
    alike: ClassVar[dict[str, str]] = {}
    sides: ClassVar[tuple[str, str] | None] = None
    terms: ClassVar[dict[str, float]] = {
        "body": 0.30,
        "joint": 0.10,
        "velocity": 0.10,
        "root": 0.10,
        "box": 0.25,
        "box_angle": 0.05,
        "contact": 0.10,
    }
    stages: ClassVar[tuple[str, ...]] = ("end_body", "end_root", "end_box", "end_grip")
    success_m = BODY_M

    def goal_features(self, body: Body, place: Place) -> Tensor:
        place = followed(place)
        reference, heading = place.reference, body.heading
        boxed = place.boxed()[:, None].float()
        parts = []
        for k in AHEAD:
            frame = reference.ahead(place.frame, k)
            position = reference.position[frame]
            keys = position[:, _KEYS] - position[:, :1]
            root = position[:, 0] + place.origin
            # as the deviation is measured: a held box from the root, a resting one in the world
            drift = torch.where(reference.held[frame, None], root - body.root, 0.0)
            there = reference.box[frame, :3] + place.origin - drift
            axes = rotations.matrix(reference.box[frame, 3:])
            grip = reference.held[frame, None].float().expand(-1, 2)
            turn = rotations.turn_back(heading, reference.heading[frame])
            world = torch.cat((keys, (root - body.root)[:, None]), dim=1)
            of_box = torch.stack((there - body.root, axes[..., 0], axes[..., 2]), dim=1)
            parts += [
                rotations.turn_back(heading[:, None], world).flatten(1),
                turn,
                boxed * rotations.turn_back(heading[:, None], of_box).flatten(1),
                grip,
            ]
        following = reference.ahead(place.frame, 1)
        parts.append(reference.setpoint[following] - joint_coordinates(body))
        if place.box is None:
            parts.append(torch.zeros(len(boxed), 10))
        else:
            reach = rotations.turn_back(heading[:, None], _reach(body, place.box)).flatten(1)
            parts.append(boxed * torch.cat((reach, place.box.half, place.mass[:, None]), dim=1))
        return torch.cat(parts, dim=1)

    def reward_terms(self, body: Body, place: Place) -> Tensor:
        place = followed(place)
        reference, frame = place.reference, place.frame
        off = deviation(body, place)
        near = torch.exp(-15.0 * off.body.square())
        joint = joint_coordinates(body) - reference.coordinates[frame]
        joint = torch.exp(-3.0 * joint.square().sum(dim=1))
        rate = body.features[:, _VELOCITY] - reference.qvel[frame, 6:]
        drift = body.root_velocity - reference.qvel[frame, :3]
        speed = torch.exp(-0.1 * rate.square().mean(dim=1) - drift.square().sum(dim=1))
        turned = 1.0 - (body.heading * reference.heading[frame]).sum(dim=1)
        root = torch.exp(-4.0 * (off.root.square() + off.height.square()) - 4.0 * turned)
        terms = [near, joint, speed, root]
        if place.box is None:
            terms += [near, joint, near]
        else:
            boxed = place.boxed()
            box = torch.exp(-15.0 * off.box.square())
            angle = torch.exp(-2.0 * _angle(place, frame).square())
            terms += [
                torch.where(boxed, box, near),
                torch.where(boxed, angle, joint),
                torch.where(boxed, _contact(body, place), near),
            ]
        return torch.stack(terms, dim=1)

    def error_m(self, body: Body, place: Place) -> Tensor:
        """[n]: rms of the bodies relative to the root, or the box's deviation where that is more,
        m."""
        off = deviation(body, followed(place))
        return torch.maximum(off.body, off.box)

    def stage(self, body: Body, place: Place) -> Tensor:
        return torch.stack(self._ends(body, followed(place)), dim=1)

    def low(self, body: Body, place: Place) -> Tensor:
        return torch.ones_like(body.root[:, 2], dtype=torch.bool)

    def fell(self, body: Body, place: Place) -> Tensor:
        """[n] bool: the character deviates, or lost the box."""
        return torch.stack(self._ends(body, followed(place)), dim=1).any(dim=1)

    def _ends(self, body: Body, place: TrackPlace) -> list[Tensor]:
        off = deviation(body, place)
        astray = (off.root > ROOT_M) | (off.height > HEIGHT_M)
        lost = (off.box > BOX_M) if place.box is not None else torch.zeros_like(astray)
        return [off.body > BODY_M, astray, lost, place.lost >= GRIP_STEPS]


def follows(task: Task) -> bool:
    """Whether a task follows clips, with what they use, instead of using a given object."""
    return isinstance(task, Track)


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


def touching(body: Body, place: Place) -> Tensor:
    """[n, 2] bool: whether the right and the left hand touch the box."""
    if place.box is None:
        return torch.zeros(len(body.root), 2, dtype=torch.bool)
    return gap_m(body, place.box) < _TOUCH_M


def gap_m(body: Body, box: BoxState) -> Tensor:
    """[n, 2]: from each hand's surface to the box's, m; negative within."""
    beyond = _in_box(body, box).abs() - box.half[:, None]
    distance = beyond.clamp_min(0.0).norm(dim=2) + beyond.amax(dim=2).clamp_max(0.0)
    return distance - _HAND_M


def _in_box(body: Body, box: BoxState) -> Tensor:
    """[n, 2, 3]: both hands' centres in the box's own axes, from its centre, m."""
    offset = body.position[:, _HANDS] - box.position[:, None]
    return (offset[..., None] * rotations.matrix(box.rotation)[:, None]).sum(dim=-2)


def _reach(body: Body, box: BoxState) -> Tensor:
    """[n, 2, 3]: from each hand to the middle of its face of the box, world axes, m: the right hand
    holds the face at −y."""
    side = torch.tensor((-1.0, 1.0))
    y = rotations.matrix(box.rotation)[..., 1]
    reach = (box.half[:, 1] + _HAND_M)[:, None] * side
    grip = box.position[:, None] + reach[..., None] * y[:, None]
    return grip - body.position[:, _HANDS]


def _contact(body: Body, place: TrackPlace) -> Tensor:
    """[n]: half for hands near the box, half for both on it, where the reference holds it; 1
    elsewhere."""
    assert place.box is not None
    gap = gap_m(body, place.box)
    near = torch.exp(-(gap.clamp_min(0.0) / 0.1).square()).mean(dim=1)
    both = (gap < _TOUCH_M).all(dim=1).float()
    return torch.where(place.holds(), 0.5 * near + 0.5 * both, 1.0)


def _angle(place: TrackPlace, frame: Tensor) -> Tensor:
    """[n]: between the box's rotation and the reference's, rad."""
    assert place.box is not None
    dot = (place.box.rotation * place.reference.box[frame, 3:]).sum(dim=1).abs()
    return 2.0 * torch.acos(dot.clamp_max(1.0))


def followed(place: Place) -> TrackPlace:
    """The place of one who follows a clip; AssertionError where there is no reference."""
    assert isinstance(place, TrackPlace), "to follow there must be a reference"
    return place
