"""Carry: pick a free box up from its stand, walk with it, and put it down on another stand.

Reward: TokenHSI's terms (walk to the box, carry it, place it, hands, put down). As in sit, the
terms are linear in the speed; the hands approach two opposite faces instead of the box's centre.
"""

from typing import ClassVar

import torch
from torch import Tensor

from world import rotations
from world.affordances import CARRIED
from world.character.features import Body, Feature, Table
from world.character.model import BODIES
from world.objects import grasp
from world.scene.box import GROUND_M
from world.scene.target import BoxState, Target
from world.tasks import detour
from world.tasks.evaluation import Evaluation, Published
from world.tasks.sit import compressed, fallen
from world.tasks.task import Task

_HANDS = (BODIES.index("right_hand"), BODIES.index("left_hand"))
_FEET = (BODIES.index("right_foot"), BODIES.index("left_foot"))
_HAND_M = 0.04
#: Speeds that earn the full reward, to the box and with it, m/s.
_SPEED_M_S = 0.9
#: The stage `approached` holds within the first horizontal distance of the box's centre; the box
#: has arrived within the second of its target, m.
_APPROACHED_M, _AT_TARGET_M = 0.70, 0.5
#: A stand pose is the second distance from the face, m; a box counts as at least the first deep
#: from its centre to the face, m.
MIN_HALF_DEPTH_M, GAP_M = 0.2, 0.16
#: The approach ends within this of the box's edge, m: 0.55 m from the centre of a box that counts
#: as at least MIN_HALF_DEPTH_M deep. Arms reach into a larger box before a root comes that near to
#: its centre.
_AT_EDGE_M = 0.35
#: Cost of a metre of depth at a face beyond that, in metres of walking to another face.
DEPTH_COST = 6.0
#: The reward of a stand pose is 0 from this distance, m, or angle, rad, on.
_OFF_M, _OFF_RAD = 0.4, 1.0
#: The hands' term: exponents of the sum of squared distances of the hands from their holds, 1/m².
#: The first leads the hands to the box, the second to the holds. By the first alone a policy took
#: large boxes with one hand 15 cm off, at the near edge, and dropped them on the way.
_WIDE, _SHARP = -8.0, -40.0
#: The place term: exponents of the squared distance of the box from its target, 1/m². The first
#: alone is 0.9 at 10 cm, and leaves little to gain by lowering the box onto its stand.
_PLACE_WIDE, _PLACE_SHARP = -10.0, -100.0
#: Height above the start at which the lift term is 1, m.
_LIFT_M = 0.2
#: Or at the second horizontal distance from the start, m; it rises from the first on, where no
#: stand is below. People carry a box from a high stand no higher than it stood.
OFF_STAND_M = 0.25, 0.35
#: Height above the start from which the stage `lifted` holds, m.
_LIFTED_M = 0.05
#: Horizontal distance from the start, while lifted, from which the stage `moved` holds, m.
_MOVED_M = 0.5
#: Value of lift and carry of a box that is held far beside its place at the target; placed it is 1.
_HELD_AT_TARGET = 0.4
#: Put down: within these of the target, vertically and horizontally, m, and slower than this, m/s.
_PUT_UP_M, _PUT_M, _STILL_M_S = 0.02, 0.10, 0.2
#: What a box that is put down is worth in the hands; the rest comes with their distance from it,
#: all of it this far off, m. Else nothing would ask for letting go.
_IN_HANDS, _OFF_HANDS_M = 0.4, 0.2
#: Hands this far off have let go, m.
_LET_GO_M = 0.1
#: A hand this near to a face touches it, m.
_TOUCH_M = 0.02
#: The box is also on the ground when a corner is this near to it, m.
_CORNER_M = 0.02
#: Horizontal distance of the feet from the root at which they no longer bear the weight, m.
_ASTRIDE_M = 0.45
#: A character whose head is no higher above the root than this lies across the box, m.
_UPRIGHT_M = 0.1
#: A low pelvis is allowed within this of the box, m.
_BENDING_M = 1.0
#: Distance beyond which the features of near boxes, targets and hands fade, m.
_NEAR_M = 0.5
_HEADING_FRAME, _FROM_HAND = "root heading", "root heading's axes, from the hand to the box"


class Carry(Task):
    """The carry task."""

    name = "carry"
    affordance = CARRIED
    episode_s = 15.0
    goal = Table(
        "goal",
        Feature("box", 3, _HEADING_FRAME, "m, beyond 1.5 m logarithmic", "compressed(H @ (o - p))"),
        Feature("target", 3, _HEADING_FRAME, "m, as above", "compressed(H @ (t - p))"),
        Feature(
            "way",
            3,
            "root heading's axes, from the box to the target",
            "m, as above",
            "compressed(H @ (t - o))",
        ),
        # The normaliser divides by the spread over 10 m, so that 10 cm to a target are a twentieth.
        # These are 0 but for near boxes and targets, with a small spread.
        Feature("near_box", 2, _HEADING_FRAME, "m, level", "near((H @ (o - p))[:2])"),
        Feature("near_way", 2, "as way", "m, level", "near((H @ (t - o))[:2])"),
        Feature("near_right_hand", 3, _FROM_HAND, "m", "near(H @ to_box(P_right_hand))"),
        Feature("near_left_hand", 3, _FROM_HAND, "m", "near(H @ to_box(P_left_hand))"),
        Feature("box_velocity", 3, _HEADING_FRAME, "m/s", "H @ b_v"),
        Feature("corners", 24, "root heading's axes, from the box", "m", "((c - o) @ H.T).ravel()"),
    )
    # the box is the first target of the walk; no other task has its target or its size
    equivalents: ClassVar[dict[str, str]] = {"box": "target", "target": "", "corners": ""}
    terms: ClassVar[dict[str, float]] = {
        "walk": 0.1,
        "grasp": 0.15,
        "lift": 0.15,
        "carry": 0.3,
        "place": 0.15,
        "put_down": 0.15,
        "overspeed": 0.2,
    }
    stages: ClassVar[tuple[str, ...]] = (
        "approached",
        "grasped",
        "lifted",
        "moved",
        "placed",
        "released",
    )
    success_m = 0.2
    evaluation = Evaluation(
        published={
            "table1": (Published("paper", 94.3, 9.1, 8.3), Published("TokenHSI", 83.1)),
            "weights": (Published("paper", 97.2, 8.7, 10.3),),
        },
        perturbed=(Published("paper", 89.4),),
    )

    def goal_features(self, body: Body, target: Target) -> Tensor:
        box = _box(target)
        there = rotations.turn_back(body.heading, box.position - body.root)
        goal = rotations.turn_back(body.heading, box.target - body.root)
        way = rotations.turn_back(body.heading, box.target - box.position)
        velocity = rotations.turn_back(body.heading, box.velocity)
        corners = rotations.turn_back(body.heading[:, None], target.corners - box.position[:, None])
        hands = _near(rotations.turn_back(body.heading[:, None], _to_box(body, box)))
        near = (_near(there[:, :2]), _near(way[:, :2]), hands.flatten(1))
        places = (compressed(there), compressed(goal), compressed(way), *near)
        return torch.cat((*places, velocity, corners.flatten(1)), 1)

    def reward_terms(self, body: Body, target: Target) -> Tensor:
        box = _box(target)
        to_box = (box.position - body.root)[:, :2]
        to_target = (box.target - box.position)[:, :2]
        there = self.error_m(body, target) < _AT_TARGET_M
        at_box = _at_box(body, box)
        walk = _progress(_closing_m_s(body.root_velocity, to_box))
        walk = torch.where(at_box, 0.5 + 0.5 * _squared(body, box), 0.8 * walk)
        # a character that leans on the box has its feet far behind it: no reward for that
        stood = _stood(body)
        walk = walk * stood
        off = reach_m(body, box).square().sum(dim=1)
        held = 0.5 * (torch.exp(_WIDE * off) + torch.exp(_SHARP * off)) * stood
        risen = ((box.position - box.start)[:, 2] / _LIFT_M).clamp(0.0, 1.0)
        near, clear = OFF_STAND_M
        gone = ((box.position - box.start)[:, :2].norm(dim=1) - near) / (clear - near)
        risen = torch.maximum(risen, gone.clamp(0.0, 1.0))
        # only a box between the hands counts as lifted, not one that was kicked up
        lift = risen * held
        missed = self.error_m(body, target).square()
        place_term = 0.5 * (torch.exp(_PLACE_WIDE * missed) + torch.exp(_PLACE_SHARP * missed))
        # the way leads round the stand that the box was taken from, where that is between
        roots, stand, goal = body.root[:, :2], box.start[:, :2], box.target[:, :2]
        aside = detour.closing_m_s(roots, body.root_velocity[:, :2], stand, goal)
        carried = _progress(_closing_m_s(box.velocity, to_target) + aside) * lift
        # at the target the box is held or placed: one that is dropped beside it earns nothing. Held
        # earns less, the less the farther it is from its place: a policy for which it was as good
        # stood there with the box for ever.
        at_target = to_target.norm(dim=1) < _AT_TARGET_M
        kept = 1.0 - (1.0 - _HELD_AT_TARGET * held) * (1.0 - place_term)
        lift, carried = torch.where(at_target, kept, lift), torch.where(at_target, kept, carried)
        put = self.put_down(box).float()
        # after putting the box down the character lets go, and may walk away
        held, walk = torch.maximum(held, put), torch.where(there, 1.0, walk)
        put = put * (
            _IN_HANDS + (1.0 - _IN_HANDS) * (_hands_away_m(body, box) / _OFF_HANDS_M).clamp_max(1.0)
        )
        excess = (box.velocity.norm(dim=1) - 2.5).clamp_min(0.0)
        overspeed = torch.exp(-2.0 * excess.square()) - 1.0
        return torch.stack((walk, held, lift, carried, place_term, put, overspeed), dim=1)

    def put_down(self, box: BoxState) -> Tensor:
        """[n] bool: the box rests at its target."""
        error = box.target - box.position
        level = error[:, 2].abs() < _PUT_UP_M
        near = error[:, :2].norm(dim=1) < _PUT_M
        return level & near & (box.velocity.norm(dim=1) < _STILL_M_S)

    def error_m(self, body: Body, target: Target) -> Tensor:
        """[n]: distance of the box from its target, m."""
        box = _box(target)
        return (box.target - box.position).norm(dim=1)

    def stage(self, body: Body, target: Target) -> Tensor:
        box = _box(target)
        approached = (box.position - body.root)[:, :2].norm(dim=1) < _APPROACHED_M
        grasped = grips(body, box)
        moved = (box.position - box.start)[:, :2].norm(dim=1) > _MOVED_M
        lifted = ((box.position - box.start)[:, 2] > _LIFTED_M) | (moved & grasped)
        placed = self.error_m(body, target) <= self.success_m
        in_hand = grasped & (lifted | moved)
        released = self.put_down(box) & (_hands_away_m(body, box) > _LET_GO_M)
        reached = (approached, grasped, grasped & lifted, in_hand & moved, placed, released)
        return torch.stack(reached, dim=1)

    def low(self, body: Body, target: Target) -> Tensor:
        return (_box(target).position - body.root)[:, :2].norm(dim=1) < _BENDING_M

    def fell(self, body: Body, target: Target) -> Tensor:
        """[n] bool: the character fell or lies across box and stand, or the box is within 30 cm of
        the ground."""
        height = _box(target).position[:, 2]
        touches = target.corners[..., 2].amin(dim=1) < _CORNER_M
        across = body.head[:, 2] - body.root[:, 2] < _UPRIGHT_M
        return fallen(body) | across | (height < GROUND_M) | touches


def _box(target: Target) -> BoxState:
    assert target.box is not None, "the task carry needs a box"
    return target.box


def _near(offset: Tensor) -> Tensor:
    """Offsets [.., k], m, that fade to 0 beyond _NEAR_M."""
    return offset * torch.exp(-offset.square().sum(dim=-1, keepdim=True) / _NEAR_M**2)


def _closing_m_s(velocity: Tensor, way: Tensor) -> Tensor:
    """[n]: speed along the horizontal way [n, 2], m/s."""
    unit = way / way.norm(dim=1, keepdim=True).clamp_min(1e-6)
    return (unit * velocity[:, :2]).sum(dim=1)


def _progress(speed: Tensor) -> Tensor:
    """[n] in [-1, 1]: speed along the way, m/s, as a fraction of the fully rewarded one; negative
    away from its end. Were it 0 there, a policy would earn by walking in circles: it did, about the
    target with the box in hand."""
    return (speed / _SPEED_M_S).clamp(-1.0, 1.0)


def _at_box(body: Body, box: BoxState) -> Tensor:
    """[n] bool: root or feet are at the box. Who bends to it moves the root back over the feet: by
    the root alone, the best posture to grip in was on the way back, and cost."""
    feet = body.position[:, _FEET].mean(dim=1)
    near = torch.zeros_like(body.root[:, 0], dtype=torch.bool)
    for point in (body.root, feet):
        to_box = (box.position - point)[:, :2]
        distance = to_box.norm(dim=1)
        along = to_box / distance.clamp_min(1e-6)[:, None]
        depth = grasp.half_depth_m(box, along).clamp_min(MIN_HALF_DEPTH_M)
        near |= distance < depth + _AT_EDGE_M
    return near


def _stood(body: Body) -> Tensor:
    """[n] in [0, 1]: 1 with the feet below the root, 0 where their centre is _ASTRIDE_M away."""
    away = (body.position[:, _FEET].mean(dim=1) - body.root)[:, :2].norm(dim=1)
    return ((_ASTRIDE_M - away) / 0.2).clamp(0.0, 1.0)


def _squared(body: Body, box: BoxState) -> Tensor:
    """[n] in [0, 1]: closeness to the stand pose before the nearest face: half for the distance and
    half for the angle, linear in both."""
    feet = body.position[:, _FEET, :2].mean(dim=1)
    ahead, points = stand_poses(box)
    off = (points - feet[:, None]).norm(dim=2)
    face = (off + DEPTH_COST * (half_depths(box) - MIN_HALF_DEPTH_M).clamp_min(0.0)).argmin(dim=1)
    rows = torch.arange(len(face), device=face.device)
    cosine = (ahead[rows, face] * body.heading).sum(dim=1).clamp(-1.0, 1.0)
    stands = (1.0 - off[rows, face] / _OFF_M).clamp_min(0.0)
    return 0.5 * stands + 0.5 * (1.0 - torch.acos(cosine) / _OFF_RAD).clamp_min(0.0)


def stand_poses(box: BoxState) -> tuple[Tensor, Tensor]:
    """Stand poses before the four upright faces: headings [n, 4, 2] and points [n, 4, 2], m."""
    axes = rotations.matrix(box.rotation)[:, :2, :2].transpose(1, 2)
    directions = torch.stack((axes[:, 0], -axes[:, 0], axes[:, 1], -axes[:, 1]), dim=1)
    directions = directions / directions.norm(dim=2, keepdim=True).clamp_min(1e-6)
    away = half_depths(box).clamp_min(MIN_HALF_DEPTH_M) + GAP_M
    return directions, box.position[:, None, :2] - directions * away[..., None]


def half_depths(box: BoxState) -> Tensor:
    """[n, 4]: distance from the centre to each of these faces, m."""
    return box.half[:, (0, 0, 1, 1)]


def _hands_in_box(body: Body, box: BoxState) -> Tensor:
    """[n, 2, 3]: centres of both hands in the box's own axes, from its centre, m."""
    offset = body.position[:, _HANDS] - box.position[:, None]
    return (offset[..., None] * rotations.matrix(box.rotation)[:, None]).sum(dim=-2)


def _to_box(body: Body, box: BoxState) -> Tensor:
    """[n, 2, 3]: from the centre of each hand to the nearest point of the box, in the world, m."""
    hands = _hands_in_box(body, box)
    half = box.half[:, None]
    gap = torch.minimum(torch.maximum(hands, -half), half) - hands
    return (rotations.matrix(box.rotation)[:, None] @ gap[..., None]).squeeze(-1)


def _hands_away_m(body: Body, box: BoxState) -> Tensor:
    """[n]: distance of the nearer hand's surface from the box, m."""
    return (_to_box(body, box).norm(dim=2).amin(dim=1) - _HAND_M).clamp_min(0.0)


def reach_m(body: Body, box: BoxState) -> Tensor:
    """[n, 2]: distance of each hand from its hold, m, on two opposite upright faces, chosen by the
    least sum of squares: their centres, or of a deep box the nearest point from there to
    grasp.HOLD_DEPTH_M from an edge."""
    hands = _hands_in_box(body, box)
    best = None
    for axis in (0, 1):
        for sign in (1.0, -1.0):
            grip = torch.zeros_like(hands)
            grip[:, 0, axis] = sign * (box.half[:, axis] + _HAND_M)
            grip[:, 1, axis] = -grip[:, 0, axis]
            play = grasp.hold_play_m(box.half[:, 1 - axis])[:, None]
            depth = hands[:, :, 1 - axis]
            grip[:, :, 1 - axis] = torch.minimum(torch.maximum(depth, -play), play)
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
