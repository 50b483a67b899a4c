"""A scripted teacher of the carry task: walks to the box, picks it up, carries it and puts it down.

It moves the whole body, by servo targets, from the state that the simulator alone knows: it says
what a policy should do in the states that it gets into. It keeps a little of the past (the step
that is being made, what was last decided), so that each scene has a porter of its own.
"""

from dataclasses import replace
from enum import IntEnum

import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.objects import grasp
from world.scene.target import BoxState, Target
from world.teachers import handling, path, phase_cue
from world.teachers.gait import Footing, Gait, unit, wrapped
from world.teachers.motion import HANDS, SERVO_S, Intent, Pace, Reach
from world.teachers.path import View
from world.teachers.whole_body import Figure, Load, Mass

_TORSO = character.BODIES.index("torso")


class Phase(IntEnum):
    """What a porter is about."""

    APPROACH = 0
    PICK_UP = 1
    CARRY = 2
    PUT_DOWN = 3


#: A box is off its stand from this height above it on, or so far from it, m.
_LIFTED_M, _MOVED_M = 0.04, 0.25
#: It is carried once the pelvis is this high, m, and the trunk's axis this much upright: its part
#: along z.
_RISEN_M, _UPRIGHT = 0.79, 0.8
#: A phase lasts at least so many control steps before the next: what is seen just after a change is
#: still of the old one.
_APPROACHES, _PICKS_UP, _CARRIES = 5, 4, 10
#: Nothing in hand after so many: once more from the way there. So long it takes to put down; with
#: the box still that far from its target, m, one has to go nearer.
_PICKS_UP_MOST, _PUTS_DOWN, _ASTRAY_M = 330, 150, 0.25
#: By no more than this is the next step's length ahead, aside, m, and turn, rad, another than the
#: last one's, alone and with the box; and no more than that is wanted of the first. Ahead, alone,
#: it may be shorter by the last.
_CHANGE, _CHANGE_LADEN, _FIRST = (0.15, 0.06, 0.35), (0.14, 0.06, 0.3), (0.2, 0.08, 0.5)
_BRAKES_M = 0.3
#: Height of a walking pelvis, m; the last metres before the box, and before the target from the
#: third on, m, one goes taller, as one stands.
_WALKS_M, _TALL_M, _TALL_FROM_M = 0.81, 0.845, 0.5
#: The box is carried so far before the root, m, beyond its own half depth, which counts as no less
#: than that; its centre this high.
_AHEAD_M, _DEPTH_M, _CARRY_M = 0.15, 0.1, 0.88
#: So far above where it stood, or will, while one is within these of the stand or the end of the
#: way, m.
_CLEAR_M, _OFF_STAND_M, _TO_TARGET_M = 0.08, 0.8, 1.2
#: It sinks there from so far before the end of the way, m.
_SINKS_FROM_M = 0.3
#: So much of the way to there at once, horizontally and up, and no more than this, m.
_SHARE, _SHARE_UP, _STEP_M = 0.2, 0.6, 0.03
#: It follows the feet's heading and the root's velocity by these shares a control step: they sway
#: with every step, the box should not.
_FOLLOW, _FOLLOW_VELOCITY = 0.2, 0.1
#: Hands are kept opposite by this at most at once, m.
_OPPOSE_M = 0.02
#: Putting down: over the target, horizontally within the first, m, the box sinks, by at most so
#: much at once; else it is taken there, by at most the last, kept so far above.
_OVER_M, _SINK_M, _ABOVE_M, _TAKE_M = 0.12, 0.04, 0.06, 0.03


#: From so near the box on a walker had better do as the porter does, m.
_TEACHES_M = 1.2


class Porter:
    """The porters of n scenes."""

    def __init__(self, n: int) -> None:
        self.gait = Gait(n)
        self.phase = torch.zeros(n, dtype=torch.int64)
        """[n]: Phase of each."""
        self._age = torch.zeros(n, dtype=torch.int64)
        self._face = torch.full((n,), -1)
        self._straight = torch.zeros(n, dtype=torch.bool)
        self._halts = torch.zeros(n, dtype=torch.bool)
        self._wish = torch.zeros(n, 3, dtype=torch.float64)
        self._yaw_rad = torch.zeros(n, dtype=torch.float64)
        self._spin = torch.zeros(n, dtype=torch.float64)
        self._velocity = torch.zeros(n, 2, dtype=torch.float64)

    def reset(self, ids: Tensor, laden: Tensor | None = None) -> None:
        """Begin anew in the scenes `ids` [m], whose characters stand; laden [m] bool: with the box
        in hand."""
        self.gait.reset(ids)
        self.phase[ids] = Phase.APPROACH
        if laden is not None:
            self.phase[ids[laden]] = Phase.CARRY
        self._age[ids], self._face[ids], self._wish[ids] = 0, -1, 0.0
        self._straight[ids] = self._halts[ids] = False

    def memory(self) -> dict[str, Tensor]:
        """All that is kept from step to step, by name."""
        own = {name: value for name, value in vars(self).items() if isinstance(value, Tensor)}
        return own | {f"gait_{name}": value for name, value in self.gait.memory().items()}

    def remember(self, memory: dict[str, Tensor]) -> None:
        """Go on from what `memory` gave."""
        for name, value in self.memory().items():
            value.copy_(memory[name])

    def teaches(self, place: Target, root: Tensor) -> Tensor:
        """[n] bool: who is from the last metres before the box on, or stands on the way, though he
        should go; root [n, 3] m. Walkers who learned it find the way there with fewer falls."""
        near = (_box(place).position - root)[:, :2].norm(dim=1) < _TEACHES_M
        return near | self.gait.balks | (self.phase != Phase.APPROACH)

    def act(self, qpos: Tensor, qvel: Tensor, place: Target, mass_kg: Tensor) -> Tensor:
        """Servo targets [n, 28] rad of the next control step, which must be made, by the porter or
        by one whose neck tells his steps as the porter's does (world.teachers.phase_cue).

        qpos [n, 43]; qvel [n, 34]; mass_kg [n]: of the boxes.
        """
        return self.intend(qpos, qvel, place, mass_kg).targets()

    def intend(self, qpos: Tensor, qvel: Tensor, place: Target, mass_kg: Tensor) -> Intent:
        """What to do in the next control step, which must be made; arguments as of `act`."""
        figure, box, mass_kg = Figure.of(qpos, qvel), _box(place), mass_kg.double()
        feet = Footing.of(figure)
        reach = handling.reach(figure, box, mass_kg, self.phase == Phase.CARRY)
        view = self._look(figure, self.gait.ending(feet), box)
        self._proceed(figure, box, view, reach.pressing)
        laden = self.phase == Phase.CARRY
        self._straight = path.aligned(view, self._straight)
        told = phase_cue.angles(qpos)
        self.gait.swing = phase_cue.first_foot(self.gait, told)
        self._wish = phase_cue.read(self.gait, told, self._wish)
        self._want(view, box, laden)
        stops = self._stops(view, laden)
        self._follow(figure, feet)
        held = reach.pressing & (self.phase >= Phase.PICK_UP)
        reach = self._reach(figure, box, view, reach, held)
        # hands that press lift with its weight, on the stand already: who does not reckon with that
        # is drawn over the stand, and pushes the box ahead of him
        mass = Mass.of(figure, Load(torch.where(held, mass_kg, 0.0), box.position))
        stride = self.gait.advance(feet, mass, self._wish, stops)
        tells = phase_cue.pose(self.gait, self._wish)
        pace = Pace(self._height(view, laden), self._velocity, tells)
        return Intent(figure, feet, mass, stride, reach, pace)

    def _look(self, figure: Figure, feet: Footing, box: BoxState) -> View:
        """Choose a face of the box, and see where that, the target and the stand are."""
        self._face = path.choose(figure.position[:, 0, :2], box, self._face)
        heading = rotations.heading(figure.qpos[:, 3:7])
        return path.view(feet, heading, box, self._face)

    def _proceed(self, figure: Figure, box: BoxState, view: View, pressing: Tensor) -> None:
        """From phase to phase."""
        stands = self.gait.stands
        upright = figure.rotation[:, _TORSO, 2, 2] > _UPRIGHT
        up = lifted(box) & pressing & (figure.position[:, 0, 2] > _RISEN_M) & upright
        astray = (box.target - box.position)[:, :2].norm(dim=1) > _ASTRAY_M
        lost = ~pressing & grasp.is_at_start(box)
        self._age += 1
        at_box, at_target = path.at_box(view), path.at_target(view)
        # who does not come nearer may as well try from where he is
        at_box = (stands & at_box) | (self.gait.balks & path.by_box(view))
        self._go(Phase.APPROACH, Phase.PICK_UP, at_box, _APPROACHES)
        self._go(Phase.PICK_UP, Phase.CARRY, up, _PICKS_UP)
        self._go(Phase.CARRY, Phase.PUT_DOWN, stands & at_target, _CARRIES)
        self._go(Phase.PUT_DOWN, Phase.CARRY, astray, _PUTS_DOWN)
        self._go(Phase.CARRY, Phase.APPROACH, lost)
        self._go(Phase.PUT_DOWN, Phase.APPROACH, lost)
        self._go(Phase.PICK_UP, Phase.APPROACH, torch.ones_like(lost), _PICKS_UP_MOST)

    def _go(self, one: Phase, other: Phase, when: Tensor, after: int = -1) -> None:
        goes = (self.phase == one) & when & (self._age > after)
        self.phase = torch.where(goes, int(other), self.phase)
        self._age = torch.where(goes, 0, self._age)

    def _want(self, view: View, box: BoxState, laden: Tensor) -> None:
        """The next step, by a little another than the last; decided when a foot has landed."""
        wish = path.wish(view, box, laden, self._straight)
        wish = torch.where(self._halts[:, None], 0.0, wish)
        alone, with_box = wish.new_tensor(_CHANGE), wish.new_tensor(_CHANGE_LADEN)
        most = torch.where(laden[:, None], with_box, alone)
        brakes = ~laden & (wish[:, 0].abs() < self._wish[:, 0].abs())
        most[:, 0] = torch.where(brakes, _BRAKES_M, most[:, 0])
        change = torch.maximum(torch.minimum(wish - self._wish, most), -most)
        wish = torch.where(self.gait.landed[:, None], self._wish + change, self._wish)
        first = wish.new_tensor(_FIRST)
        begins = torch.maximum(torch.minimum(wish, first), -first)
        self._wish = torch.where(self.gait.walks[:, None], wish, begins)

    def _stops(self, view: View, laden: Tensor) -> Tensor:
        """[n] bool: the feet should come to rest."""
        stays = (self.phase == Phase.PICK_UP) | (self.phase == Phase.PUT_DOWN)
        self._halts = path.arrived(view, laden, self._halts) & ~stays
        return stays | self._halts

    def _height(self, view: View, laden: Tensor) -> Tensor:
        """[n]: of the pelvis while one walks, m."""
        tall = torch.where(laden, view.left_m < _TALL_FROM_M, self._straight)
        return torch.where(tall, _TALL_M, _WALKS_M).double()

    def _follow(self, figure: Figure, feet: Footing) -> None:
        """The heading and the velocity that the box goes along with."""
        anew = (self._age <= 1) | (self.phase < Phase.CARRY)
        yaw_rad = torch.atan2(feet.heading[:, 1], feet.heading[:, 0])
        turn = _FOLLOW * wrapped(yaw_rad - self._yaw_rad)
        self._yaw_rad = torch.where(anew, yaw_rad, self._yaw_rad + turn)
        self._spin = torch.where(anew, 0.0, turn * character.CONTROL_HZ)
        velocity = figure.velocity[:, :2]
        change = _FOLLOW_VELOCITY * (velocity - self._velocity)
        self._velocity = torch.where(anew[:, None], velocity, self._velocity + change)

    def _reach(self, figure: Figure, box: BoxState, view: View, near: Reach, held: Tensor) -> Reach:
        """What the hands do: nothing on the way to the box, `near` at it; with it in hand, `held`
        [n] bool, carry it or put it down."""
        laden, down = self.phase == Phase.CARRY, self.phase == Phase.PUT_DOWN
        way = torch.where(down[:, None], _put(box), self._carry(figure, box, view))
        step = way[:, None] + self._opposed(figure)
        step = torch.where(laden[:, None, None], step + self._swept(figure), step)
        faces = near.faces - box.position[:, None]
        goal = box.target[:, None] + faces
        height_m = torch.where(laden, box.position[:, 2], near.height_m)
        return replace(
            near,
            led=self.phase >= Phase.PICK_UP,
            pressing=held & ~down,
            step=torch.where((held & (laden | down))[:, None, None], step, near.step),
            force=torch.where(held[:, None, None], near.force, 0.0),
            goal=torch.where(down[:, None, None], goal, near.goal),
            height_m=torch.where(down, box.target[:, 2], height_m),
        )

    def _carry(self, figure: Figure, box: BoxState, view: View) -> Tensor:
        """[n, 3]: where the box goes next, m from where it is: before the body, and above the
        stands."""
        heading = rotations.heading(figure.qpos[:, 3:7])
        ahead = _AHEAD_M + grasp.deep_m(box, heading).clamp_min(_DEPTH_M)
        level = figure.position[:, 0, :2] + ahead[:, None] * unit(self._yaw_rad)
        start = torch.where(view.off_stand_m < _OFF_STAND_M, box.start[:, 2], 0.0)
        end = torch.where(view.left_m < _TO_TARGET_M, box.target[:, 2], 0.0)
        height = torch.maximum(start, end) + _CLEAR_M
        # sinking on the last steps, it needs less time where it is put down
        height = torch.where(view.left_m < _SINKS_FROM_M, height, height.clamp_min(_CARRY_M))
        way = torch.cat((level, height[:, None]), dim=1) - box.position
        return grasp.shortened(way * way.new_tensor((_SHARE, _SHARE, _SHARE_UP)), _STEP_M)

    def _swept(self, figure: Figure) -> Tensor:
        """[n, 2, 3]: how far the hands have to be led on to go round the root with the heading, m:
        left to `_carry` alone a box would lag behind a turn, and be lost."""
        arm = figure.position[:, HANDS] - figure.position[:, :1]
        arm = arm * (SERVO_S * self._spin)[:, None, None]
        return torch.stack((-arm[..., 1], arm[..., 0], torch.zeros_like(arm[..., 0])), dim=2)

    def _opposed(self, figure: Figure) -> Tensor:
        """[n, 2, 3]: what brings the hands to lie across the heading from one another, m."""
        right, left = figure.position[:, HANDS].unbind(1)
        ahead = unit(self._yaw_rad)
        across = torch.stack((-ahead[:, 1], ahead[:, 0], torch.zeros_like(ahead[:, 0])), dim=1)
        between = right - left
        skew = between - (between * across).sum(dim=1, keepdim=True) * across
        back = grasp.shortened(-0.5 * skew, _OPPOSE_M)
        return torch.stack((back, -back), dim=1)


def _put(box: BoxState) -> Tensor:
    """[n, 3]: where a box goes next that is put down, m from where it is."""
    way = box.target - box.position
    over = way[:, :2].norm(dim=1, keepdim=True) < _OVER_M
    sinks = way[:, 2:].clamp(-_SINK_M, _SINK_M)
    above = (way[:, 2:] + _ABOVE_M).clamp(-_TAKE_M, _TAKE_M)
    return torch.cat((grasp.shortened(way[:, :2], _TAKE_M), torch.where(over, sinks, above)), dim=1)


def lifted(box: BoxState) -> Tensor:
    """[n] bool: the box is off its stand."""
    gone = box.position - box.start
    return (gone[:, 2] > _LIFTED_M) | (gone[:, :2].norm(dim=1) > _MOVED_M)


def _box(place: Target) -> BoxState:
    """The box in float64."""
    box = place.box
    assert box is not None, "a porter needs a box"
    return BoxState(
        box.position.double(),
        box.rotation.double(),
        box.velocity.double(),
        box.half.double(),
        box.start.double(),
        box.target.double(),
    )
