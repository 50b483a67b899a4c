"""The scripted controller of the carry task: walk to the box, pick it up, carry it, put it down.

It computes servo set-points of the whole body from the simulator's state. It drives the character
itself, or observes while a student drives and computes what it would do. It keeps some state of
each scene (the step under way, the last choices).
"""

from collections.abc import Mapping
from dataclasses import replace
from enum import IntEnum

import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.objects import grasp
from world.scene.target import BoxState, Target
from world.teachers.scripted import handling, path, phase_cue
from world.teachers.scripted.gait import Footing, Gait, unit, wrapped
from world.teachers.scripted.motion import HANDS, SERVO_S, Intent, Pace, Reach
from world.teachers.scripted.path import View
from world.teachers.scripted.whole_body import Figure, Load, Mass, shortened

_TORSO = character.BODIES.index("torso")


class Phase(IntEnum):
    """The controller's phase."""

    APPROACH = 0
    PICK_UP = 1
    CARRY = 2
    PUT_DOWN = 3


#: A box is lifted from this height above its start on, or this far from it, m.
_LIFTED_M, _MOVED_M = 0.04, 0.25
#: Carrying begins with the pelvis this high, m, and the trunk this upright: z component of its
#: axis.
_RISEN_M, _UPRIGHT = 0.79, 0.8
#: A phase lasts more than this many control steps: the state just after a change still belongs to
#: the previous one.
_APPROACHES, _PICKS_UP, _CARRIES = 5, 4, 10
#: A pick-up ends without success after this many control steps and the approach begins again.
#: Putting down takes at least this many; with the box still this far from its target, m, the
#: carrying begins again.
_PICKS_UP_MOST, _PUTS_DOWN, _ASTRAY_M = 330, 150, 0.25
#: Largest change between two step commands, ahead and aside, m, and turn, rad, without and with the
#: box; and the bounds of the first command. Without the box a command may shorten by the last, m.
_CHANGE, _CHANGE_CARRYING, _FIRST = (0.15, 0.06, 0.35), (0.14, 0.06, 0.3), (0.2, 0.08, 0.5)
_BRAKES_M = 0.3
#: Height of the walking pelvis, m; the second on the straight approach to the box and within the
#: third distance of the target, m.
_WALKS_M, _TALL_M, _TALL_FROM_M = 0.81, 0.845, 0.5
#: A carried box is this far before the root, m, plus its half depth, which counts as no less than
#: the second; its centre is this high, m.
_AHEAD_M, _DEPTH_M, _CARRY_M = 0.15, 0.1, 0.88
#: Clearance above its position on a stand, m, within the second distance of its start and the third
#: of its target, m.
_CLEAR_M, _OFF_STAND_M, _TO_TARGET_M = 0.08, 0.8, 1.2
#: It sinks to that height from this far before the end of the path, m.
_SINKS_FROM_M = 0.3
#: Fraction of the way there in one step, horizontally and up, and its bound, m.
_SHARE, _SHARE_UP, _STEP_M = 0.2, 0.6, 0.03
#: Filter coefficients, per control step, of the feet's heading and the root's velocity: the box
#: does not follow their sway.
_FOLLOW, _FOLLOW_VELOCITY = 0.2, 0.1
#: Largest correction of the hands' opposition in one step, m.
_OPPOSE_M = 0.02
#: Putting down: within the first horizontal distance of the target, m, the box sinks by at most the
#: second in one step; elsewhere it moves by at most the fourth, the third above the target, m.
_OVER_M, _SINK_M, _ABOVE_M, _TAKE_M = 0.12, 0.04, 0.06, 0.03
#: The controller's action is a useful label within this distance of the box, m.
_USEFUL_M = 1.2


class CarryController:
    """Controllers of n scenes."""

    def __init__(self, n: int) -> None:
        self.gait = Gait(n)
        self.phase = torch.zeros(n, dtype=torch.int64)
        """[n]: Phase of each."""
        self._age = torch.zeros(n, dtype=torch.int64)
        self._face = torch.full((n,), -1)
        self._straight = torch.zeros(n, dtype=torch.bool)
        self._halts = torch.zeros(n, dtype=torch.bool)
        self._step_command = torch.zeros(n, 3, dtype=torch.float64)
        self._yaw_rad = torch.zeros(n, dtype=torch.float64)
        self._spin = torch.zeros(n, dtype=torch.float64)
        self._velocity = torch.zeros(n, 2, dtype=torch.float64)

    def reset(self, ids: Tensor, carrying: Tensor | None = None) -> None:
        """Reset the scenes `ids` [m], whose characters stand; carrying [m] bool: with the box in
        hand."""
        self.gait.reset(ids)
        self.phase[ids] = Phase.APPROACH
        if carrying is not None:
            self.phase[ids[carrying]] = Phase.CARRY
        self._age[ids], self._face[ids], self._step_command[ids] = 0, -1, 0.0
        self._straight[ids] = self._halts[ids] = False

    def state_dict(self) -> dict[str, Tensor]:
        """The state that is kept from step to step, by name; the tensors themselves."""
        own = {
            name.removeprefix("_"): value
            for name, value in vars(self).items()
            if isinstance(value, Tensor)
        }
        return own | {f"gait_{name}": value for name, value in self.gait.state_dict().items()}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        for name, value in self.state_dict().items():
            value.copy_(state[name])

    def is_useful(self, target: Target, root: Tensor) -> Tensor:
        """[n] bool: the action is a useful label: near the box, after the approach, or where the
        student stalls; root [n, 3] m. On the way to the box a trained walker falls less often than
        a student of the controller."""
        near = (_box(target).position - root)[:, :2].norm(dim=1) < _USEFUL_M
        return near | self.gait.stalled | (self.phase != Phase.APPROACH)

    def set_points(self, qpos: Tensor, qvel: Tensor, target: Target, mass_kg: Tensor) -> Tensor:
        """Servo set-points [n, 28] rad of the next control step. The simulation must then advance
        by that step, driven by these or by a student that shows the phase cue
        (world.teachers.scripted.phase_cue).

        qpos [n, 43]; qvel [n, 34]; mass_kg [n]: of the boxes.
        """
        return self.intend(qpos, qvel, target, mass_kg).set_points()

    def intend(self, qpos: Tensor, qvel: Tensor, target: Target, mass_kg: Tensor) -> Intent:
        """The intent of the next control step, by which the simulation must then advance; arguments
        as of `set_points`."""
        figure, box, mass_kg = Figure.of(qpos, qvel), _box(target), mass_kg.double()
        feet = Footing.of(figure)
        reach = handling.reach(figure, box, mass_kg, self.phase == Phase.CARRY)
        view = self._look(figure, self.gait.ending(feet), box)
        self._proceed(figure, box, view, reach.pressing)
        carrying = self.phase == Phase.CARRY
        self._straight = path.aligned(view, self._straight)
        neck = phase_cue.angles(qpos)
        self.gait.swing = phase_cue.first_foot(self.gait, neck)
        self._step_command = phase_cue.read(self.gait, neck, self._step_command)
        self._plan_step(view, box, carrying)
        stops = self._stops(view, carrying)
        self._follow(figure, feet)
        held = reach.pressing & (self.phase >= Phase.PICK_UP)
        reach = self._reach(figure, box, view, reach, held)
        # pressing hands lift with the weight of the box while it is still on its stand: without
        # the load in the balance the mass moves over the stand and pushes the box ahead
        mass = Mass.of(figure, Load(torch.where(held, mass_kg, 0.0), box.position))
        stride = self.gait.advance(feet, mass, self._step_command, stops)
        cue = phase_cue.pose(self.gait, self._step_command)
        pace = Pace(self._height(view, carrying), self._velocity, cue)
        return Intent(figure, feet, mass, stride, reach, pace)

    def _look(self, figure: Figure, feet: Footing, box: BoxState) -> View:
        """Choose a face of the box; the view towards it, the target and the stand."""
        self._face = path.choose(figure.position[:, 0, :2], box, self._face)
        heading = rotations.heading(figure.qpos[:, 3:7])
        return path.view(feet, heading, box, self._face)

    def _proceed(self, figure: Figure, box: BoxState, view: View, pressing: Tensor) -> None:
        """Advance the phases."""
        stands = self.gait.standing
        upright = figure.rotation[:, _TORSO, 2, 2] > _UPRIGHT
        up = lifted(box) & pressing & (figure.position[:, 0, 2] > _RISEN_M) & upright
        astray = (box.target - box.position)[:, :2].norm(dim=1) > _ASTRAY_M
        lost = ~pressing & grasp.is_at_start(box)
        self._age += 1
        at_box, at_target = path.at_box(view), path.at_target(view)
        # a stalled character tries from where it stands
        at_box = (stands & at_box) | (self.gait.stalled & path.by_box(view))
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

    def _plan_step(self, view: View, box: BoxState, carrying: Tensor) -> None:
        """Update the step command by a bounded change where a foot has landed."""
        last = self._step_command
        wanted = path.step_command(view, box, carrying, self._straight)
        wanted = torch.where(self._halts[:, None], 0.0, wanted)
        alone, with_box = wanted.new_tensor(_CHANGE), wanted.new_tensor(_CHANGE_CARRYING)
        most = torch.where(carrying[:, None], with_box, alone)
        brakes = ~carrying & (wanted[:, 0].abs() < last[:, 0].abs())
        most[:, 0] = torch.where(brakes, _BRAKES_M, most[:, 0])
        change = torch.maximum(torch.minimum(wanted - last, most), -most)
        command = torch.where(self.gait.landed[:, None], last + change, last)
        first = command.new_tensor(_FIRST)
        begins = torch.maximum(torch.minimum(command, first), -first)
        self._step_command = torch.where(self.gait.stepping[:, None], command, begins)

    def _stops(self, view: View, carrying: Tensor) -> Tensor:
        """[n] bool: the feet come to rest."""
        stays = (self.phase == Phase.PICK_UP) | (self.phase == Phase.PUT_DOWN)
        self._halts = path.arrived(view, carrying, self._halts) & ~stays
        return stays | self._halts

    def _height(self, view: View, carrying: Tensor) -> Tensor:
        """[n]: of the walking pelvis, m."""
        tall = torch.where(carrying, view.left_m < _TALL_FROM_M, self._straight)
        return torch.where(tall, _TALL_M, _WALKS_M).double()

    def _follow(self, figure: Figure, feet: Footing) -> None:
        """Filter the heading and the velocity that the box follows."""
        anew = (self._age <= 1) | (self.phase < Phase.CARRY)
        yaw_rad = torch.atan2(feet.heading[:, 1], feet.heading[:, 0])
        turn = _FOLLOW * wrapped(yaw_rad - self._yaw_rad)
        self._yaw_rad = torch.where(anew, yaw_rad, self._yaw_rad + turn)
        self._spin = torch.where(anew, 0.0, turn * character.CONTROL_HZ)
        velocity = figure.velocity[:, :2]
        change = _FOLLOW_VELOCITY * (velocity - self._velocity)
        self._velocity = torch.where(anew[:, None], velocity, self._velocity + change)

    def _reach(self, figure: Figure, box: BoxState, view: View, near: Reach, held: Tensor) -> Reach:
        """What the hands do: nothing during the approach, `near` during the pick-up; with the box
        in hand, `held` [n] bool, they carry it or put it down."""
        carrying, down = self.phase == Phase.CARRY, self.phase == Phase.PUT_DOWN
        way = torch.where(down[:, None], _put(box), self._carry(figure, box, view))
        step = way[:, None] + self._opposed(figure)
        step = torch.where(carrying[:, None, None], step + self._swept(figure), step)
        faces = near.faces - box.position[:, None]
        goal = box.target[:, None] + faces
        height_m = torch.where(carrying, box.position[:, 2], near.height_m)
        return replace(
            near,
            active=self.phase >= Phase.PICK_UP,
            pressing=held & ~down,
            step=torch.where((held & (carrying | down))[:, None, None], step, near.step),
            force=torch.where(held[:, None, None], near.force, 0.0),
            goal=torch.where(down[:, None, None], goal, near.goal),
            height_m=torch.where(down, box.target[:, 2], height_m),
        )

    def _carry(self, figure: Figure, box: BoxState, view: View) -> Tensor:
        """[n, 3]: next move of a carried box, m: to its position before the body, clear of the
        stands."""
        heading = rotations.heading(figure.qpos[:, 3:7])
        ahead = _AHEAD_M + grasp.half_depth_m(box, heading).clamp_min(_DEPTH_M)
        level = figure.position[:, 0, :2] + ahead[:, None] * unit(self._yaw_rad)
        start = torch.where(view.off_stand_m < _OFF_STAND_M, box.start[:, 2], 0.0)
        end = torch.where(view.left_m < _TO_TARGET_M, box.target[:, 2], 0.0)
        height = torch.maximum(start, end) + _CLEAR_M
        # sinking during the last steps shortens the putting down
        height = torch.where(view.left_m < _SINKS_FROM_M, height, height.clamp_min(_CARRY_M))
        way = torch.cat((level, height[:, None]), dim=1) - box.position
        return shortened(way * way.new_tensor((_SHARE, _SHARE, _SHARE_UP)), _STEP_M)

    def _swept(self, figure: Figure) -> Tensor:
        """[n, 2, 3]: move of the hands round the root with the turn of the heading, m. Without it
        the box lags behind a turn and slips."""
        arm = figure.position[:, HANDS] - figure.position[:, :1]
        arm = arm * (SERVO_S * self._spin)[:, None, None]
        return torch.stack((-arm[..., 1], arm[..., 0], torch.zeros_like(arm[..., 0])), dim=2)

    def _opposed(self, figure: Figure) -> Tensor:
        """[n, 2, 3]: correction that brings the line between the hands across the heading, m."""
        right, left = figure.position[:, HANDS].unbind(1)
        ahead = unit(self._yaw_rad)
        across = torch.stack((-ahead[:, 1], ahead[:, 0], torch.zeros_like(ahead[:, 0])), dim=1)
        between = right - left
        skew = between - (between * across).sum(dim=1, keepdim=True) * across
        back = shortened(-0.5 * skew, _OPPOSE_M)
        return torch.stack((back, -back), dim=1)


def _put(box: BoxState) -> Tensor:
    """[n, 3]: next move of a box that is put down, m."""
    way = box.target - box.position
    over = way[:, :2].norm(dim=1, keepdim=True) < _OVER_M
    sinks = way[:, 2:].clamp(-_SINK_M, _SINK_M)
    above = (way[:, 2:] + _ABOVE_M).clamp(-_TAKE_M, _TAKE_M)
    return torch.cat((shortened(way[:, :2], _TAKE_M), torch.where(over, sinks, above)), dim=1)


def lifted(box: BoxState) -> Tensor:
    """[n] bool: the box is lifted off its start."""
    gone = box.position - box.start
    return (gone[:, 2] > _LIFTED_M) | (gone[:, :2].norm(dim=1) > _MOVED_M)


def _box(target: Target) -> BoxState:
    """The box in float64."""
    box = target.box
    assert box is not None, "the carry controller needs a box"
    return BoxState(
        box.position.double(),
        box.rotation.double(),
        box.velocity.double(),
        box.half.double(),
        box.start.double(),
        box.target.double(),
    )
