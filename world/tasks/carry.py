"""Carry: pick a free box up from its stand, walk with it, and put it down on another.

Reward: TokenHSI's terms (walk to the box, carry it, place it, hands, put down), with speeds that
count linearly, as in sit, and hands that seek two opposite faces instead of the box' middle.
"""

from typing import ClassVar

import torch
from torch import Tensor

from world import rotations
from world.character.features import Body, Feature, Table
from world.character.model import BODIES
from world.tasks.sit import compressed, fallen
from world.tasks.task import Affordance, BoxState, Place

_HANDS = (BODIES.index("right_hand"), BODIES.index("left_hand"))
_FEET = (BODIES.index("right_foot"), BODIES.index("left_foot"))
_HAND_M = 0.04
#: Speeds that earn the full reward, to the box and with it, m/s.
_SPEED_M_S = 0.9
#: Within these of the box (its centre, horizontally) and of the target the way is done, m.
_AT_BOX_M, _AT_TARGET_M = 0.55, 0.5
#: Of a box that is no less deep than the first, m, from its centre to the edge, one stands this far
#: from the edge to pick it up, m.
DEEP_M, GAP_M = 0.2, 0.16
#: Each metre that it is deeper at a face costs what so many on the way to another one do.
COST_DEEP = 6.0
#: Who is so far from such a place, m, or turned away so, rad, earns nothing for it.
_OFF_M, _OFF_RAD = 0.4, 1.0
#: Lifted by this it counts as carried in full, m.
_LIFT_M = 0.2
#: Lifted off its stand, for the stage, m.
_LIFTED_M = 0.05
#: Moved, for the stage: this far while lifted, m.
_MOVED_M = 0.5
#: Put down: within these of the target, and slower than this, m and m/s.
_PUT_UP_M, _PUT_M, _STILL_M_S = 0.02, 0.10, 0.2
#: A hand this near to a face touches it, m.
_TOUCH_M = 0.02
#: The box is on the ground when its centre is this low, or a corner this near to it, m.
GROUND_M, _CORNER_M = 0.30, 0.02
#: Feet so far from below the root bear nobody who stands, m.
_ASTRIDE_M = 0.45
#: Who bends so far that the head is no higher above the root than this leans on the box, m.
_UPRIGHT_M = 0.1
#: About the box one may bend down, m.
_BENDING_M = 1.0
_HEADING_FRAME = "root heading"


class Carry:
    """The carry task."""

    name = "carry"
    affordance: Affordance = "carry"
    episode_s = 15.0
    goal = Table(
        "goal",
        Feature("box", 3, _HEADING_FRAME, "m, beyond 1.5 m logarithmic"),
        Feature("target", 3, _HEADING_FRAME, "m, as above"),
        Feature("way", 3, "root heading's axes, from the box to the target", "m, as above"),
        Feature("box_velocity", 3, _HEADING_FRAME, "m/s"),
        Feature("corners", 24, "root heading's axes, from the box", "m"),
    )
    # Where one walks first; what the box' target means, no other task knows, nor its size.
    alike: ClassVar[dict[str, str]] = {"box": "target", "target": "", "corners": ""}
    sides: ClassVar[tuple[str, str] | None] = None
    terms: ClassVar[dict[str, float]] = {
        "walk": 0.1,
        "grasp": 0.15,
        "lift": 0.15,
        "carry": 0.3,
        "place": 0.15,
        "put_down": 0.15,
        "overspeed": 0.2,
    }
    stages: ClassVar[tuple[str, ...]] = ("approached", "grasped", "lifted", "moved", "placed")
    success_m = 0.2

    def goal_features(self, body: Body, place: Place) -> Tensor:
        box = _box(place)
        there = rotations.turn_back(body.heading, box.position - body.root)
        target = rotations.turn_back(body.heading, box.target - body.root)
        way = rotations.turn_back(body.heading, box.target - box.position)
        velocity = rotations.turn_back(body.heading, box.velocity)
        corners = rotations.turn_back(body.heading[:, None], place.corners - box.position[:, None])
        places = (compressed(there), compressed(target), compressed(way))
        return torch.cat((*places, velocity, corners.flatten(1)), 1)

    def reward_terms(self, body: Body, place: Place) -> Tensor:
        box = _box(place)
        to_box = (box.position - body.root)[:, :2]
        to_target = (box.target - box.position)[:, :2]
        there = self.error_m(body, place) < _AT_TARGET_M
        at_box = to_box.norm(dim=1) < _AT_BOX_M
        walk = _towards(body.root_velocity, to_box)
        walk = torch.where(at_box, 0.5 + 0.5 * _squared(body, box), 0.8 * walk)
        # who leans on the box has his feet far behind him: that neither reaches nor lifts
        stood = _stood(body)
        walk = walk * stood
        grasp = torch.exp(-8.0 * reach_m(body, box).square().sum(dim=1)) * stood
        risen = ((box.position - box.start)[:, 2] / _LIFT_M).clamp(0.0, 1.0)
        # a box that was kicked up is not lifted: the hands are on it
        lift = risen * grasp
        place_term = torch.exp(-10.0 * (box.target - box.position).square().sum(dim=1))
        carried = _towards(box.velocity, to_target) * lift
        # there it is in the hands, or where it should be: a box that is dropped beside its target
        # earns nothing
        at_target = to_target.norm(dim=1) < _AT_TARGET_M
        kept = torch.maximum(grasp, place_term)
        lift, carried = torch.where(at_target, kept, lift), torch.where(at_target, kept, carried)
        put = self.put_down(box).float()
        # who has put it down may let go and walk off
        grasp, walk = torch.maximum(grasp, put), torch.where(there, 1.0, walk)
        excess = (box.velocity.norm(dim=1) - 2.5).clamp_min(0.0)
        overspeed = torch.exp(-2.0 * excess.square()) - 1.0
        return torch.stack((walk, grasp, lift, carried, place_term, put, overspeed), dim=1)

    def put_down(self, box: BoxState) -> Tensor:
        """[n] bool: the box stands where it should, still."""
        error = box.target - box.position
        level = error[:, 2].abs() < _PUT_UP_M
        near = error[:, :2].norm(dim=1) < _PUT_M
        return level & near & (box.velocity.norm(dim=1) < _STILL_M_S)

    def error_m(self, body: Body, place: Place) -> Tensor:
        """[n]: the box' distance from its target, m."""
        box = _box(place)
        return (box.target - box.position).norm(dim=1)

    def stage(self, body: Body, place: Place) -> Tensor:
        box = _box(place)
        approached = (box.position - body.root)[:, :2].norm(dim=1) < _AT_BOX_M + 0.15
        grasped = grips(body, box)
        moved = (box.position - box.start)[:, :2].norm(dim=1) > _MOVED_M
        lifted = ((box.position - box.start)[:, 2] > _LIFTED_M) | (moved & grasped)
        placed = self.error_m(body, place) <= self.success_m
        in_hand = grasped & (lifted | moved)
        return torch.stack((approached, grasped, grasped & lifted, in_hand & moved, placed), dim=1)

    def low(self, body: Body, place: Place) -> Tensor:
        return (_box(place).position - body.root)[:, :2].norm(dim=1) < _BENDING_M

    def fell(self, body: Body, place: Place) -> Tensor:
        """[n] bool: the character fell, or lies across box and stand, or the box is within 30 cm of
        the ground."""
        height = _box(place).position[:, 2]
        touches = place.corners[..., 2].amin(dim=1) < _CORNER_M
        across = body.head[:, 2] - body.root[:, 2] < _UPRIGHT_M
        return fallen(body) | across | (height < GROUND_M) | touches


def _box(place: Place) -> BoxState:
    assert place.box is not None, "to carry there must be a box"
    return place.box


def _towards(velocity: Tensor, way: Tensor) -> Tensor:
    """[n] in [0, 1]: speed along the horizontal way [n, 2], of that which earns all."""
    unit = way / way.norm(dim=1, keepdim=True).clamp_min(1e-6)
    return ((unit * velocity[:, :2]).sum(dim=1) / _SPEED_M_S).clamp(0.0, 1.0)


def _stood(body: Body) -> Tensor:
    """[n] in [0, 1]: 1 with the feet below the root, 0 where their middle is _ASTRIDE_M away."""
    away = (body.position[:, _FEET].mean(dim=1) - body.root)[:, :2].norm(dim=1)
    return ((_ASTRIDE_M - away) / 0.2).clamp(0.0, 1.0)


def _squared(body: Body, box: BoxState) -> Tensor:
    """[n] in [0, 1]: whether the character stands where the box is picked up from, before the
    nearest face and facing it: half for the place and half for the turn, linear in both."""
    feet = body.position[:, _FEET, :2].mean(dim=1)
    ahead, spots = places_before(box)
    off = (spots - feet[:, None]).norm(dim=2)
    face = (off + COST_DEEP * (depths(box) - DEEP_M).clamp_min(0.0)).argmin(dim=1)
    rows = torch.arange(len(face), device=face.device)
    cosine = (ahead[rows, face] * body.heading).sum(dim=1).clamp(-1.0, 1.0)
    place = (1.0 - off[rows, face] / _OFF_M).clamp_min(0.0)
    return 0.5 * place + 0.5 * (1.0 - torch.acos(cosine) / _OFF_RAD).clamp_min(0.0)


def places_before(box: BoxState) -> tuple[Tensor, Tensor]:
    """Of the four upright faces: the directions to look at them [n, 4, 2], and the places to stand
    before them [n, 4, 2], m."""
    axes = rotations.matrix(box.rotation)[:, :2, :2].transpose(1, 2)
    directions = torch.stack((axes[:, 0], -axes[:, 0], axes[:, 1], -axes[:, 1]), dim=1)
    directions = directions / directions.norm(dim=2, keepdim=True).clamp_min(1e-6)
    away = depths(box).clamp_min(DEEP_M) + GAP_M
    return directions, box.position[:, None, :2] - directions * away[..., None]


def depths(box: BoxState) -> Tensor:
    """[n, 4]: from the centre to each of these faces, m."""
    return box.half[:, (0, 0, 1, 1)]


def _hands_in_box(body: Body, box: BoxState) -> Tensor:
    """[n, 2, 3]: both hands' centres in the box' own axes, from its centre, m."""
    offset = body.position[:, _HANDS] - box.position[:, None]
    return (offset[..., None] * rotations.matrix(box.rotation)[:, None]).sum(dim=-2)


def reach_m(body: Body, box: BoxState) -> Tensor:
    """[n, 2]: how far each hand is from where it would hold the box, m: the middles of two opposite
    upright faces, chosen so that both are nearest together."""
    hands = _hands_in_box(body, box)
    best = None
    for axis in (0, 1):
        for sign in (1.0, -1.0):
            grip = torch.zeros_like(hands)
            grip[:, 0, axis] = sign * (box.half[:, axis] + _HAND_M)
            grip[:, 1, axis] = -grip[:, 0, axis]
            gap = (hands - grip).norm(dim=2)
            nearer = best is None or (gap.square().sum(1) < best.square().sum(1))[:, None]
            best = gap if best is None else torch.where(torch.as_tensor(nearer), gap, best)
    assert best is not None
    return best


def grips(body: Body, box: BoxState) -> Tensor:
    """[n] bool: both hands touch the box, on opposite faces."""
    hands = _hands_in_box(body, box)
    beyond = hands.abs() - box.half[:, None]
    distance = beyond.clamp_min(0.0).norm(dim=2) + beyond.amax(dim=2).clamp_max(0.0)
    touching = (distance < _HAND_M + _TOUCH_M).all(dim=1)
    face = beyond.argmax(dim=2)
    same_axis = face[:, 0] == face[:, 1]
    side = torch.gather(hands, 2, face[..., None])[..., 0]
    return touching & same_axis & (side[:, 0] * side[:, 1] < 0.0)
