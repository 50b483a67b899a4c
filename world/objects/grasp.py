"""Arms led by a scripted grip, for the lessons in which legs and trunk learn to serve them.

Reaching for a box, pressing on it from both sides and lifting it is a matter of geometry, which
noise about a walker's hanging arms does not find (docs/recipe.md, "Carry"); balance under a load is
not, and that is what is left to the policy. What the arms do is a function of the moment alone.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.character import kinematics, servos
from world.character import model as character
from world.scene.box import FRICTION
from world.tasks.task import BoxState, Place

_BODY = character.BODIES.index
_TORSO = _BODY("torso")
#: Of each side, right first: the upper arm's, the lower arm's and the hand's body, and the first of
#: its four servos (three of the shoulder, one of the elbow).
_SIDES = tuple(
    (_BODY(f"{side}_upper_arm"), _BODY(f"{side}_lower_arm"), _BODY(f"{side}_hand"), first)
    for side, first in (("right", 6), ("left", 10))
)
#: By that servo: where the shoulder's quaternion and the elbow's angle stand in qpos.
_ADDRESSES = {
    first: (character.BALL_QPOS[ball], character.HINGE_QPOS[hinge])
    for first, ball, hinge in ((6, 2, 0), (10, 3, 1))
}
_UPPER_M, _FORE_M, _HAND_M = 0.274788, 0.258947, 0.04
#: The arms are led while the box is this near to the root, horizontally, and before it, m.
_REACH_M = 0.85
#: A hand passes beside a face at this distance until it is within _BESIDE_M of its middle, m.
_CLEAR_M, _BESIDE_M = 0.05, 0.06
#: A hand nearer to the plane of its face than this, or behind it, does not get past the box, m.
_IN_THE_WAY_M = 0.02
#: Hands this near to where they hold press, and lift, m.
_SIDEWAYS_M, _OFF_M = 0.10, 0.03
#: In the air a box is pressed on by hands this near to where they should hold it, m.
_KEPT_M = 0.25
#: A hand presses this many times as hard as the weight needs, and so many N more.
_GRIP, _GRIP_N = 3.0, 50.0
_GRAVITY_M_S2 = 9.81
#: Farthest that a hand's place is led on ahead of the hand, m: servos move it by ten times that a
#: second.
_STEP_M = 0.06
#: The same with the box between them: faster, it slips, m.
_LIFT_M = 0.02
#: How far the elbow's place is led down, m.
_SINK_M = 0.01
#: Where a box is held: its near edge before the root, and its centre above it, m.
_BEFORE_M, _ABOVE_M = 0.16, 0.12
#: The servo that bends the trunk forward, and the most that it is bent, rad.
_BEND, _BENT_RAD = 1, 0.9
#: It is bent over a box this near to the root only: sooner, a walker topples, m.
_OVER_BOX_M = 0.5
#: From the shoulder a hand is this far off with ease, m; the trunk is led on by so much for what is
#: amiss, rad/m, and by no more than this, rad.
_EASY_M, _BEND_RAD_M, _BENDING_RAD = 0.45, 1.0, 0.06
#: So far from there the arms reach out to put it down, m.
_OUT_M = 0.25
#: So near to its target, horizontally, a box is lowered; within these it is let go, m.
_OVER_M, _DOWN_M, _AT_M = 0.12, 0.02, 0.09


@dataclass(frozen=True)
class Grip:
    """Where the hands hold."""

    axis: Tensor
    """[n, 3]: from the box's middle to the left hand's face, horizontal unit vector."""
    out_m: Tensor
    """[n]: from the middle to a hand's centre that touches."""


def lead(qpos: Tensor, place: Place, mass_kg: Tensor) -> tuple[Tensor, Tensor]:
    """Servo targets [n, 28] rad by which the arms reach for, hold, lift and put down the box near
    them; and which of them it says anything of, [n, 28] bool: the arms', where the box is within
    reach.

    qpos [n, 43]; mass_kg [n]: of the boxes.
    """
    box = place.box
    assert box is not None, "hands are led to a box"
    heading = rotations.heading(qpos[:, 3:7])
    near = _near(box, qpos, heading)
    targets = qpos.new_zeros(len(qpos), character.NU)
    said = torch.zeros(len(qpos), character.NU, dtype=torch.bool, device=qpos.device)
    rows = near.nonzero().flatten()
    if len(rows):
        for first, angles in _angles(qpos[rows], box.rows(rows), heading[rows], mass_kg[rows]):
            columns = slice(first, first + angles.shape[1])
            targets[rows, columns] = angles.to(targets)
            said[rows, columns] = True
    low, high = (torch.from_numpy(bound).to(targets) for bound in character.target_bounds())
    return torch.maximum(torch.minimum(targets, high), low), said


def before(root: Tensor, heading: Tensor, depth_m: Tensor) -> Tensor:
    """[n, 3]: where the centre of a box in hand is held, m; root [n, 3], heading [n, 2], depth_m
    [n]: from its centre to its edge along the heading."""
    ahead = root[:, :2] + (_BEFORE_M + depth_m)[:, None] * heading
    return torch.cat((ahead, root[:, 2:] + _ABOVE_M), dim=1)


def holding(qpos: Tensor, box: BoxState) -> Tensor:
    """qpos [n, 43] with the arms bent so that the hands touch the box on both sides, or come as
    near as the arms are long."""
    position, rotation = kinematics.forward(
        qpos[:, :3], rotations.matrix(kinematics.local_rotations(qpos))
    )
    grip = grip_of(box, rotations.heading(qpos[:, 3:7]))
    found = qpos.clone()
    for sign, (upper, lower, _, first) in zip((-1.0, 1.0), _SIDES, strict=True):
        goal = box.position + sign * grip.axis * grip.out_m[:, None]
        bent = _reach(position, rotation, goal, sign, upper, lower, sink_m=1.0)
        ball, hinge = _ADDRESSES[first]
        found[:, ball : ball + 4] = rotations.from_rotation_vector(bent[:, :3]).to(found)
        found[:, hinge] = bent[:, 3].to(found)
    return found


def _angles(
    qpos: Tensor, box: BoxState, heading: Tensor, mass_kg: Tensor
) -> list[tuple[int, Tensor]]:
    """First servos and targets [n, k] rad from there on: of each arm's four, and of the bend of
    the trunk."""
    position, rotation = kinematics.forward(
        qpos[:, :3], rotations.matrix(kinematics.local_rotations(qpos))
    )
    grip = grip_of(box, heading)
    placed, rests = is_placed(box), is_at_start(box)
    reached, hands, goals, steps = [], [], [], []
    for sign, (_, _, hand, _) in zip((-1.0, 1.0), _SIDES, strict=True):
        here = position[:, hand]
        outward = sign * grip.axis
        hold = box.position + outward * grip.out_m[:, None]
        gap = here - hold
        off = (gap * outward).sum(dim=1)
        beside = (gap - off[:, None] * outward).norm(dim=1)
        apart = beside > _BESIDE_M
        clear = torch.where((rests & apart) | placed, _CLEAR_M, 0.0)
        goals.append(hold + clear[:, None] * outward)
        # between the planes of the faces the box is in the way: sideways first, then along it
        sideways = ((clear - off).clamp(-_STEP_M, _STEP_M))[:, None] * outward
        along = shortened(gap - off[:, None] * outward, _STEP_M)
        free = ((off - _IN_THE_WAY_M) / _IN_THE_WAY_M).clamp(0.0, 1.0)
        free = torch.where(rests & apart, free, 1.0)
        steps.append(sideways - free[:, None] * along)
        # a box that stands may be let go and gripped better; one in the air may not
        close = (beside < _SIDEWAYS_M) & (off.abs() < _OFF_M)
        reached.append(close | (~rests & (gap.norm(dim=1) < _KEPT_M)))
        hands.append(here)
    both = reached[0] & reached[1] & ~placed
    onward = _onward(box, position, heading)
    weight = mass_kg * _GRAVITY_M_S2
    press = _GRIP * weight / (2.0 * FRICTION) + _GRIP_N
    up = qpos.new_tensor((0.0, 0.0, 0.5))
    found = []
    short = torch.zeros_like(weight)
    for k, sign in enumerate((-1.0, 1.0)):
        upper, lower, hand, first = _SIDES[k]
        goal = torch.where(both[:, None], hands[k] + onward, goals[k])
        short += 0.5 * ((goal - position[:, upper]).norm(dim=1) - _EASY_M)
        step = torch.where(both[:, None], onward, steps[k])
        angles = _reach(position, rotation, hands[k] + step, sign, upper, lower)
        force = -sign * press[:, None] * grip.axis + weight[:, None] * up
        pull = _pull(position, rotation, force, upper, lower, hand)
        found.append((first, angles + torch.where(both[:, None], pull, 0.0)))
    at_box = (box.position - qpos[:, :3])[:, :2].norm(dim=1) < _OVER_BOX_M
    # with the box in hand the trunk comes up, but where it is put down
    over = (box.target - box.position)[:, :2].norm(dim=1) < _OVER_M
    short = torch.where(at_box & (~both | over), short, -_EASY_M)
    bend = servos.coordinates(qpos)[:, _BEND].to(short)
    bend = bend + (_BEND_RAD_M * short).clamp(-_BENDING_RAD, _BENDING_RAD)
    return [*found, (_BEND, bend.clamp(0.0, _BENT_RAD)[:, None])]


def _near(box: BoxState, qpos: Tensor, heading: Tensor) -> Tensor:
    """[n] bool: the box is within reach and not behind."""
    there = box.position[:, :2] - qpos[:, :2]
    return (there.norm(dim=1) < _REACH_M) & ((there * heading).sum(dim=1) > 0.0)


def is_placed(box: BoxState) -> Tensor:
    """[n] bool: the box stands where it should."""
    error = box.target - box.position
    return (error[:, 2].abs() < _DOWN_M) & (error[:, :2].norm(dim=1) < _AT_M)


def is_at_start(box: BoxState) -> Tensor:
    """[n] bool: the box is on the stand that it started on."""
    gone = box.position - box.start
    return (gone[:, 2] < 0.02) & (gone[:, :2].norm(dim=1) < 0.19)


def grip_of(box: BoxState, heading: Tensor) -> Grip:
    """The two opposite upright faces that lie most to the sides of the heading [n, 2]."""
    axes = rotations.matrix(box.rotation)[:, :, :2]
    left = torch.stack((-heading[:, 1], heading[:, 0]), dim=1)
    along = (axes[:, :2] * left[..., None]).sum(dim=1)
    chosen = along.abs().argmax(dim=1)
    rows = torch.arange(len(chosen), device=chosen.device)
    sign = torch.where(along[rows, chosen] < 0, -1.0, 1.0)
    return Grip(axes[rows, :, chosen] * sign[:, None], box.half[rows, chosen] + _HAND_M)


def _onward(box: BoxState, position: Tensor, heading: Tensor) -> Tensor:
    """[n, 3]: where the hands take the box next, m from where it is: up before the body, out over
    its target where the arms reach so far, and down once it is over it."""
    error = box.target - box.position
    over = error[:, :2].norm(dim=1) < _OVER_M
    # before the chest, where the trunk is bent
    lean = ((position[:, _TORSO] - position[:, 0])[:, :2] * heading).sum(dim=1).clamp_min(0.0)
    held = before(position[:, 0], heading, deep_m(box, heading))
    held = torch.cat((held[:, :2] + lean[:, None] * heading, held[:, 2:]), dim=1)
    within = (box.target - held)[:, :2].norm(dim=1) < _OUT_M
    held[:, :2] = torch.where(within[:, None], box.target[:, :2], held[:, :2])
    # off the stand first: a box is not drawn along it, and the way there takes nothing of the lift
    risen = (box.position - box.start)[:, 2] > 0.02
    moved = (box.position - box.start)[:, :2].norm(dim=1) > 0.3
    free = (risen | moved)[:, None]
    way = held - box.position
    way = torch.cat((torch.where(free, way[:, :2], 0.0), way[:, 2:]), dim=1)
    carried = shortened(way, _LIFT_M)
    return torch.where(over[:, None], shortened(error, _LIFT_M), carried)


def deep_m(box: BoxState, heading: Tensor) -> Tensor:
    """[n]: from the box' centre to its edge along a heading [n, 2], m."""
    axes = rotations.matrix(box.rotation)[:, :2, :2]
    return ((axes * heading[..., None]).sum(dim=1).abs() * box.half[:, :2]).sum(dim=1)


def shortened(way: Tensor, most: float) -> Tensor:
    """Vectors [n, k] cut to a length of at most `most`."""
    return way * (most / way.norm(dim=1, keepdim=True).clamp_min(most))


def _reach(
    position: Tensor,
    rotation: Tensor,
    goal: Tensor,
    sign: float,
    upper: int,
    lower: int,
    sink_m: float = _SINK_M,
) -> Tensor:
    """[n, 4]: rotation vector of the shoulder and angle of the elbow, rad, that bring the hand to
    `goal` [n, 3], or as near as the arm is long. The elbow stays on the side of the line to the
    hand that it is on, and sinks out and down by and by: turned at once it would push the hand."""
    torso = rotation[:, _TORSO]
    there = ((goal - position[:, upper])[:, None] @ torso)[:, 0]
    far = there.norm(dim=1).clamp(0.12, 0.995 * (_UPPER_M + _FORE_M))
    cosine = (far.square() - _UPPER_M**2 - _FORE_M**2) / (2 * _UPPER_M * _FORE_M)
    bent = torch.acos(cosine.clamp(-1.0, 1.0))
    zero = torch.zeros_like(bent)
    # in the upper arm's own frame: the hand, and the elbow's offset from the line to it
    hand = torch.stack((_FORE_M * bent.sin(), zero, -_UPPER_M - _FORE_M * bent.cos()), dim=1)
    elbow = torch.stack((zero, zero, zero - _UPPER_M), dim=1)
    down = there.new_tensor((-0.3, 0.5 * sign, -1.0))
    now = ((position[:, lower] - position[:, upper])[:, None] @ torso)[:, 0]
    wanted, own = _frame(there, now + sink_m * down), _frame(hand, elbow)
    shoulder = rotations.to_rotation_vector(rotations.from_matrix(wanted @ own.transpose(1, 2)))
    return torch.cat((shoulder, bent[:, None]), dim=1)


def _frame(along: Tensor, beside: Tensor) -> Tensor:
    """[n, 3, 3]: columns along [n, 3], the part of `beside` [n, 3] across it, and their product."""
    x = along / along.norm(dim=1, keepdim=True).clamp_min(1e-6)
    y = beside - (beside * x).sum(dim=1, keepdim=True) * x
    y = y / y.norm(dim=1, keepdim=True).clamp_min(1e-6)
    return torch.stack((x, y, torch.linalg.cross(x, y)), dim=2)


def _pull(
    position: Tensor, rotation: Tensor, force: Tensor, upper: int, lower: int, hand: int
) -> Tensor:
    """[n, 4]: how far beyond their place the arm's servos must be told to be, rad, for the hand to
    press with `force` [n, 3] N: each axis' moment by its stiffness."""
    from_shoulder = torch.linalg.cross(position[:, hand] - position[:, upper], force)
    from_elbow = torch.linalg.cross(position[:, hand] - position[:, lower], force)
    shoulder = (rotation[:, upper] * from_shoulder[:, :, None]).sum(dim=1)
    elbow = -(rotation[:, lower, :, 1] * from_elbow).sum(dim=1, keepdim=True)
    moments = torch.cat((shoulder, elbow), dim=1)
    kp = torch.from_numpy(character.gains()[0]).to(moments)[6:10]
    return moments / kp
