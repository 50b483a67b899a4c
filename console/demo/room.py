"""One character in a room: it is sent from goal to goal, and no state is reset on the way.

The policy of the goal's task drives it. Where something stands in the way, the walk policy goes
around first. No shipped policy stands up: a helping hand (`console.demo.hoist`) brings the
character to its feet after a rest or a fall.
"""

import copy
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from console.demo.contents import Contents
from console.demo.goals import BoxGoal, FloorGoal, Goal, nearest, sides
from console.demo.hoist import STANDING_M, Hoist
from console.demo.layout import Layout
from console.kinds.poses import HERE
from console.kinds.setup import Pose
from console.play.balls import Thrower
from console.play.pushes import Pushes
from console.play.scene import STEP_S, UnstableError
from console.play.source import heading
from policy.checkpoints.served import Served
from world.affordances import Affordance
from world.character import model as character
from world.character import servos
from world.errors import ChoiceError, ConfigError
from world.furniture.usage import usage
from world.scene.target import state
from world.tasks.sit import fallen

#: The limit of success to which errors are scaled, m.
GOAL_M = 0.2
#: Distance of the walk policy's target ahead on the way around furniture, m.
_LEAD_M = 1.2
#: A goal is reached after this time of uninterrupted success, s.
_HELD_S = 0.5
#: A character is helped up after it has lain fallen for this time, s.
_FALLEN_S = 1.0
#: A policy that has not reached its goal after this time, s, begins again, with a box after the
#: second; a box that has lain on the floor for the third is put back on a stand.
_TRIES_S, _TRIES_BOX_S, _LOST_S = 20.0, 45.0, 2.0
#: While it chooses for itself, the character stays at a goal for this time, s, and leaves one that
#: it has not reached after the second.
_STAYS_S, _LEAVES_S = 2.0, 60.0
#: A character with a lower root, m, or a less upright trunk (height of its unit axis) is not on its
#: feet.
_LOW_M, _UPRIGHT = 0.75, 0.85
#: Height above what it rests on to which a character is lifted first, m.
_OFF_M = 0.5
#: Height above standing in which the feet hang free, m.
_HANGS_M = 0.1
#: Set-points of standing [1, 28] rad.
_STANDING = servos.coordinates(torch.from_numpy(character.standing_qpos())[None])


class Stage(Enum):
    """What drives the character."""

    HELP = "helped to its feet"
    WALK = "walks around"
    TASK = ""


@dataclass
class Control:
    """What is decided from step to step; copied into every moment."""

    goal: Goal
    stage: Stage = Stage.TASK
    hoist: Hoist | None = None
    way: list[NDArray[np.float64]] = field(default_factory=list)
    fallen_s: float = 0.0
    held_s: float = 0.0
    tries_s: float = 0.0
    lost_s: float = 0.0
    since_s: float = 0.0
    falls: int = 0
    reached: int = 0
    resting_on: Goal | None = None
    """The goal on which the character rests, also after another is chosen."""


@dataclass(frozen=True)
class RoomMoment:
    """A room at one control step, sufficient to draw and to continue it."""

    physics: dict[str, Tensor]
    control: Control
    things: tuple[tuple[Pose, Pose], ...]
    """Pose and wanted pose of each thing."""
    balls: NDArray[np.float64]
    error_m: float
    """Error of the goal's task, in units of its limit, times GOAL_M."""


class Room(Contents):
    """A furnished room with a character; not thread-safe."""

    def __init__(self, policies: Mapping[str, Served], layout: Layout, seed: int = 0) -> None:
        """policies: by name; one must walk. Raises ConfigError without it."""
        self.policies = dict(policies)
        self._walks = self._of_kind("floor")
        if self._walks is None:
            raise ConfigError(
                "the demo needs a policy that walks: train one with inhabit train walk"
            )
        world = self.policies[self._walks].world
        super().__init__(layout, world.action_scale, world.action_clip)
        self._force = self.scenes.batch.bind("xfrc_applied")
        self._thrower = Thrower(self.scenes, seed)
        self._pushes = Pushes(STEP_S)
        self._random = np.random.default_rng(seed)
        self.wanders = False
        """Whether the character chooses its next goal itself."""
        self.time_step = 0
        start = layout.start
        self.control = Control(self._point(start))
        self._begin(start)

    def _begin(self, start: Pose) -> None:
        qpos = character.standing_qpos()
        qpos[:2] = start.x, start.y
        qpos[3:7] = math.cos(start.yaw / 2), 0.0, 0.0, math.sin(start.yaw / 2)
        self.scenes.set_state(
            HERE,
            torch.from_numpy(qpos)[None],
            torch.zeros(1, character.NV),
            *self.stands[0].origin(),
        )
        self._furnish()
        self._thrower.step(self.time_step, self.scenes.body(), 0.0)

    def _of_kind(self, kind: str) -> str | None:
        named = {p.task.affordance.kind: n for n, p in reversed(self.policies.items())}
        return named.get(kind)

    # goals

    def goals(self) -> dict[str, list[str]]:
        """What the character can be sent to: policy -> names of pieces or boxes; no names where it
        goes to points of the floor."""
        names: dict[str, Callable[[Affordance], list[str]]] = {
            "furniture": self._usable,
            "box": lambda _: list(self.box_names),
            "floor": lambda _: [],
        }
        affordances = {name: p.task.affordance for name, p in self.policies.items()}
        return {n: names[a.kind](a) for n, a in affordances.items() if a.kind in names}

    def _usable(self, affordance: Affordance) -> list[str]:
        """Names of the pieces that have the affordance."""
        return [
            thing.name
            for thing in self.pieces
            if thing.piece.category in _categories(affordance)
            and usage(affordance.name).use_points(thing.piece)
        ]

    def send(self, policy: str, name: str) -> None:
        """Send the character to use a piece, or to carry a box to the free stand.

        Raises ChoiceError for an unknown policy or name.
        """
        choices = self.goals()
        if policy not in choices:
            raise ChoiceError("policy", policy, list(choices))
        if name not in choices[policy]:
            raise ChoiceError("piece", name, choices[policy])
        affordance = self.policies[policy].task.affordance
        if name in self.box_names:
            self._sent(self._carry(policy, name))
            return
        goals = sides(policy, f"{policy}: {name}", self.things[name], affordance.name)
        free = [goal for goal in goals if bool(self._others(goal).free(goal.entry()))]
        self._sent(nearest(free or goals, self.root()))

    def send_anywhere(self) -> None:
        """Send the character to another goal, by the seed."""
        every = [(policy, name) for policy, names in self.goals().items() for name in names or [""]]
        resting = self.control.goal.label
        every = [pair for pair in every if f"{pair[0]}: {pair[1]}" != resting]
        policy, name = every[int(self._random.integers(len(every)))]
        if name:
            self.send(policy, name)
            return
        x, y, yaw = self._random.uniform((-1.5, -1.5, -math.pi), (1.5, 1.5, math.pi)).tolist()
        self.walk(Pose(x, y, yaw))

    def walk(self, pose: Pose) -> None:
        """Send the character to the free point of the floor that is nearest to a pose."""
        plan = self.plan()
        x, y = plan.nearest_free(np.array([pose.x, pose.y])).tolist()
        self._sent(self._point(Pose(x, y, pose.yaw)))

    def _point(self, pose: Pose) -> FloorGoal:
        assert self._walks is not None
        return FloorGoal(self._walks, f"{self._walks}: {pose.x:.1f}, {pose.y:.1f} m", pose)

    def _carry(self, policy: str, name: str) -> BoxGoal:
        index = self.box_names.index(name)
        taken = [self.stand_of(i) for i in range(len(self._boxes))]
        free = [stand for stand in self.stands if stand not in taken]
        if taken[index] is None:
            # a box on the floor is out of reach: it is put back
            back = min(free, key=lambda s: math.dist((s.pose.x, s.pose.y), self._box_at(index)[:2]))
            self._put_on(index, back)
            free.remove(back)
        return BoxGoal(policy, name, self._boxes[index], index, free[0], self.scenes)

    def _sent(self, goal: Goal) -> None:
        now = self.control
        resting = now.resting_on
        if now.stage is Stage.TASK and now.goal.surface_m > 0.0:
            resting = now.goal
        self.control = Control(
            goal, hoist=now.hoist, falls=now.falls, reached=now.reached, resting_on=resting
        )
        self._start()

    def _start(self) -> None:
        """Begin with what the character's state needs first."""
        now = self.control
        if now.hoist is not None:
            now.stage = Stage.HELP
        elif not self._on_feet():
            self._help()
        else:
            now.resting_on = None
            self._set_out()

    def _help(self) -> None:
        """Begin to help the character to its feet."""
        now, root = self.control, self.root()
        rest = now.resting_on
        if rest is not None and math.dist(rest.target(self.scenes).point[0, :2], root) > 0.8:
            rest = None  # it has left or fallen off
        exit_at = root if rest is None else rest.entry()
        exit_at = self.plan().nearest_free(exit_at)
        over = 0.0 if rest is None else rest.surface_m
        over = max([over, *(self._height_at(root, t) for t in self.pieces)])
        up = max(STANDING_M, over + _OFF_M)
        away = exit_at - root
        yaw = heading(self._qpos()) if np.linalg.norm(away) < 0.1 else math.atan2(away[1], away[0])
        # the feet hang free before they are put down, so that they come below the pelvis
        path = [(*root, up), (*exit_at, up), (*exit_at, STANDING_M + _HANGS_M)]
        path += [(*exit_at, STANDING_M)]
        now.hoist = Hoist([np.array(point) for point in path], yaw)
        now.stage, now.held_s, now.fallen_s = Stage.HELP, 0.0, 0.0

    def _set_out(self) -> None:
        """Begin the way to the goal, or its task."""
        now = self.control
        now.way, now.stage, now.held_s = [], Stage.TASK, 0.0
        plan = self._others(now.goal)
        entry, root = now.goal.entry(), self.root()
        if plan.clear(root, entry) and now.goal.takes_over(root):
            return
        now.way, now.stage = plan.way(root, entry), Stage.WALK

    # state

    def _qpos(self) -> NDArray[np.float64]:
        return self.scenes.qpos[0].numpy()

    def root(self) -> NDArray[np.float64]:
        """The character's root on the floor [2], m."""
        return self._qpos()[:2].copy()

    def _on_feet(self) -> bool:
        _w, x, y, _z = self._qpos()[3:7]
        return self._qpos()[2] > _LOW_M and 1 - 2 * (x * x + y * y) > _UPRIGHT

    # disturbances

    def push(self, impulse_n_s: NDArray[np.float64], body: str) -> None:
        """Push a body by an impulse [3] N s, world frame, spread over the next step.

        Raises ChoiceError for an unknown body.
        """
        self._pushes.add(impulse_n_s, body)

    def throw(self) -> None:
        """Throw a ball at the character, at the next step."""
        self._thrower.throw(self.time_step)

    # time

    @torch.inference_mode()
    def step(self) -> RoomMoment:
        """Step by 1/30 s; UnstableError for a non-finite state."""
        if self._glide() and self.control.stage is Stage.WALK:
            self._set_out()
        self._choose()
        self._thrower.step(self.time_step, self.scenes.body(), STEP_S)
        self._pushes.apply(self._force[0])
        self._drive()
        self.time_step += 1
        if not bool(self.scenes.finite()[0]):
            raise UnstableError("the simulation became unstable: go back and push or move less")
        return self._moment()

    def _choose(self) -> None:
        now = self.control
        now.since_s += STEP_S
        left = now.since_s > _LEAVES_S
        if self.wanders and (now.held_s >= _STAYS_S or (left and now.hoist is None)):
            self.send_anywhere()

    def _drive(self) -> None:
        now = self.control
        if now.hoist is not None:
            qpos, qvel = self._qpos(), self.scenes.qvel[0].numpy()
            self._force[0, 1] += now.hoist.wrench(qpos, qvel, STEP_S)
            self.scenes.drive(_STANDING)
            if now.hoist.done:
                now.hoist, now.resting_on = None, None
                self._set_out()
            return
        name, target = now.goal.policy, now.goal.target(self.scenes)
        if now.stage is Stage.WALK:
            assert self._walks is not None
            name, target = self._walks, self._ahead().target(self.scenes)
        served = self.policies[name]
        carrying = now.goal.carries and now.stage is Stage.TASK
        wanted = self._carrying if carrying else self._calm
        if self.scenes.models[0] is not wanted:
            self.scenes.set_models([0], [wanted])
        body = self.scenes.body()
        seen = torch.cat((state(body, target), served.task.goal_features(body, target)), dim=1)
        self.scenes.act(served.act(seen))
        self._judge()

    def _ahead(self) -> FloorGoal:
        """The walk policy's target on the way; begins the task where the way is over."""
        now, root = self.control, self.root()
        plan = self._others(now.goal)
        if plan.clear(root, now.goal.entry()) and now.goal.takes_over(root):
            now.stage = Stage.TASK
        while len(now.way) > 1 and (
            math.dist(now.way[0], root) < 0.4 or plan.clear(root, now.way[1])
        ):
            now.way.pop(0)
        way = now.way[0] - root
        length = max(float(np.linalg.norm(way)), 1e-6)
        at = root + way * min(1.0, _LEAD_M / length) if len(now.way) > 1 else now.way[0]
        return self._point(Pose(float(at[0]), float(at[1]), math.atan2(way[1], way[0])))

    def _judge(self) -> None:
        """Count success and falls after a step, and help after a fall."""
        now, body = self.control, self.scenes.body()
        down = bool(fallen(body)[0]) or ((
            now.stage is Stage.WALK or now.goal.surface_m == 0.0
        ) and not self._on_feet())  # fmt: skip
        now.fallen_s = now.fallen_s + STEP_S if down else 0.0
        if now.fallen_s > _FALLEN_S:
            now.falls += 1
            self._help()
            return
        good = now.stage is Stage.TASK and self.error_m() <= self._task().success_m and not down
        before = now.held_s
        now.held_s = now.held_s + STEP_S if good else 0.0
        now.reached += before < _HELD_S <= now.held_s
        if good and now.goal.surface_m > 0.0:
            now.resting_on = now.goal
        self._try_again()

    def _try_again(self) -> None:
        """Begin the goal again where its policy has lost the box, or is at the end of its wits."""
        now, goal = self.control, self.control.goal
        tries = now.stage is Stage.TASK and now.held_s == 0.0
        now.tries_s = now.tries_s + STEP_S if tries else 0.0
        lost = isinstance(goal, BoxGoal) and goal.lost(self.scenes)
        now.lost_s = now.lost_s + STEP_S if lost else 0.0
        if now.lost_s <= _LOST_S and now.tries_s <= (_TRIES_BOX_S if goal.carries else _TRIES_S):
            return
        if isinstance(goal, BoxGoal):
            now.goal = self._carry(goal.policy, goal.box_name)
        now.tries_s = now.lost_s = 0.0
        if self._on_feet():
            self._set_out()
        else:
            self._help()

    def _task(self) -> Any:
        return self.policies[self.control.goal.policy].task

    def error_m(self) -> float:
        """Error of the goal's task, m."""
        target = self.control.goal.target(self.scenes)
        return float(self._task().error_m(self.scenes.body(), target)[0])

    @property
    def done(self) -> bool:
        """Whether the goal is reached, and held for a while."""
        return self.control.held_s >= _HELD_S

    @torch.inference_mode()
    def now(self) -> RoomMoment:
        """Return the present moment."""
        return self._moment()

    def _moment(self) -> RoomMoment:
        return RoomMoment(
            physics=self.scenes.physics(),
            control=kept(self.control),
            things=tuple((t.pose, t.wanted) for t in self.things.values()),
            balls=self._thrower.position().double().numpy(),
            error_m=self.error_m() * GOAL_M / self._task().success_m,
        )

    def restore(self, moment: RoomMoment, step: int) -> None:
        """Restore a moment of this room, before the control step `step`, without balls."""
        self.scenes.load_physics(moment.physics)
        for thing, (pose, wanted) in zip(self.things.values(), moment.things, strict=True):
            thing.pose, thing.wanted = pose, wanted
        self.control = kept(moment.control)
        self._plan = None
        self._thrower.clear()
        self._pushes.clear()
        self.time_step = step


def kept(control: Control) -> Control:
    """A copy of what changes in a control; goals hold no state."""
    found = copy.copy(control)
    found.hoist, found.way = copy.deepcopy(control.hoist), list(control.way)
    return found


@cache
def _categories(affordance: Affordance) -> frozenset[str]:
    """Classes of furniture that the task of an affordance is trained and evaluated with."""
    return frozenset(piece.category for piece in affordance.choices("test").values())
