"""One policy in one scene, stepped interactively, with pushes, balls and a moving target."""

import math
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from console.kinds import kind
from console.kinds.setup import Pose, Setup, check
from console.play.balls import Thrower
from console.play.frames import UnstableError
from console.play.pushes import Pushes
from policy.checkpoints.served import Served
from world.character import model as character
from world.furniture.piece import Piece
from world.scene.batch import Scenes
from world.scene.target import state

STEP_S = 1.0 / character.CONTROL_HZ
#: Speeds at which the target moves to its new pose: a jump could place it inside the character.
GLIDE_M_S, GLIDE_RAD_S = 1.5, 2.0
_HERE = torch.zeros(1, dtype=torch.int64)


@dataclass(frozen=True)
class Moment:
    """The scene at one control step, sufficient to draw, measure and continue it."""

    physics: dict[str, Tensor]
    """Physics of Scenes.physics, [1, ...]."""
    state: Tensor
    """[114] features."""
    balls: NDArray[np.float64]
    """[k, 3] m; NaN for balls out of the scene."""
    goal: Pose
    """Pose of the target."""
    terms: NDArray[np.float32]
    """Reward terms, unweighted, in the task's order."""
    error_m: float
    success: bool
    fell: bool
    style: float | None
    """Style reward of the preceding step; None without a discriminator, and at the start."""


class Scene:
    """A character, its policy and its object; not thread-safe."""

    def __init__(self, served: Served, piece: Piece, setup: Setup) -> None:
        """Compile the scene and set its initial state. piece: scaled."""
        self.served, self.piece = served, piece
        self.setup = check(setup, piece, served.task.affordance)
        self.task = served.task
        world = served.world
        self._object = kind(self.task).played(setup, piece, self.task, world.carry, Thrower.balls())
        self.model = self._object.model
        self._scenes = Scenes([self.model], world.action_scale, world.action_clip)
        self._force = self._scenes.batch.bind("xfrc_applied")
        self._thrower = Thrower(self._scenes, setup.seed)
        self._pushes = Pushes(STEP_S)
        self._goal = self._wanted = setup.goal
        self.time_step = 0
        self._begin(setup.start)

    def _begin(self, start: Pose) -> None:
        qpos, half = character.standing_qpos(), 0.5 * start.yaw
        qpos[:2] = start.x, start.y
        qpos[3:7] = math.cos(half), 0.0, 0.0, math.sin(half)
        self._scenes.set_state(
            _HERE,
            torch.from_numpy(qpos)[None],
            torch.zeros(1, character.NV),
            torch.zeros(1, 3),
            torch.tensor([[1.0, 0.0]]),
        )
        self._object.begin(self._scenes)
        self._thrower.step(self.time_step, self._scenes.body(), 0.0)

    @property
    def goal(self) -> Pose:
        """Present pose of the target."""
        return self._goal

    def move(self, goal: Pose) -> None:
        """Move the target towards another pose, from the next step on."""
        # the same bounds as those of a setup
        self._wanted = check(
            Setup(self.setup.policy, self.setup.piece, goal=goal), self.piece, self.task.affordance
        ).goal

    def push(self, impulse_n_s: NDArray[np.float64], body: str) -> None:
        """Push a body by an impulse [3] N s, world frame, spread over the next step.

        Raises ChoiceError for an unknown body.
        """
        self._pushes.add(impulse_n_s, body)

    def throw(self) -> None:
        """Throw a ball at the character, at the next step."""
        self._thrower.throw(self.time_step)

    @torch.inference_mode()
    def now(self) -> Moment:
        """Return the present moment."""
        return self._moment(None)

    @torch.inference_mode()
    def step(self) -> Moment:
        """Step by 1/30 s; UnstableError for a non-finite state."""
        self._goal = self._goal.stepped(self._wanted, GLIDE_M_S * STEP_S, GLIDE_RAD_S * STEP_S)
        self._object.move(self._scenes, self._goal)
        body, target = self._scenes.body(), self._object.target(self._scenes)
        self._thrower.step(self.time_step, body, STEP_S)
        before = state(body, target)
        self._pushes.apply(self._force[0])
        goal = self.task.goal_features(body, target)
        self._scenes.act(self.served.act(torch.cat((before, goal), dim=1)))
        self.time_step += 1
        if not bool(self._scenes.finite()[0]):
            raise UnstableError("the simulation became unstable: go back and push or move less")
        return self._moment(before)

    def restore(self, moment: Moment, step: int) -> None:
        """Restore a moment of this scene, before the control step `step`, without balls."""
        self._scenes.load_physics(moment.physics)
        self._goal = self._wanted = moment.goal
        self._object.move(self._scenes, moment.goal)
        self._thrower.clear()
        self._pushes.clear()
        self.time_step = step

    def _moment(self, before: Tensor | None) -> Moment:
        body, target = self._scenes.body(), self._object.target(self._scenes)
        seen = state(body, target)
        judge = self.served.style
        error = float(self.task.error_m(body, target)[0])
        return Moment(
            physics=self._scenes.physics(),
            state=seen[0],
            balls=self._thrower.position().double().numpy(),
            goal=self._goal,
            terms=self.task.reward_terms(body, target)[0].numpy(),
            error_m=error,
            success=error <= self.task.success_m,
            fell=bool(self.task.fell(body, target)[0]),
            style=None if judge is None or before is None else float(judge(before, seen)[0]),
        )
