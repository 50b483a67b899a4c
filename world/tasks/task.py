"""The base class of tasks: goal, named weighted reward terms, success, stages and termination, the
affordance of its object, and evaluation settings."""

from abc import ABC, abstractmethod
from typing import ClassVar

import torch
from torch import Tensor

from world.affordances import Affordance
from world.character.features import Body, Table
from world.scene.target import Target
from world.tasks.evaluation import Evaluation

#: Name of the last stage of every task: success held. The shard computes it, since `stage` depends
#: on one control step alone.
HELD = "held"
#: Prefix of stages that are causes of failure.
END = "end_"


class Task(ABC):
    """A task; all tensors are float32 over n scenes."""

    name: ClassVar[str]
    affordance: ClassVar[Affordance]
    """Affordance of the object, from world.affordances: training objects, initial states, trials,
    and the use of clips."""
    episode_s: ClassVar[float] = 10.0
    """Length of a training episode, s."""
    goal: ClassVar[Table]
    equivalents: ClassVar[dict[str, str]] = {}
    """Of this task's goal features: the name of the equivalent one in other tasks; empty: none.
    Networks that are initialised from another task's map features by these and by equal names."""
    level: ClassVar[tuple[str, ...]] = ()
    """Features of state and goal that are positions of a height that never varies: what the
    networks know of their z is the root's height. Networks that another task takes over keep that
    alone."""
    sides: ClassVar[tuple[str, str] | None] = None
    """Two goal features whose first two numbers are directions on the floor. Where the second
    points to the right of the first, the networks observe the mirrored scene, so that they learn
    one side alone. Both are constant in an episode but for the heading. None: nothing is
    mirrored."""
    terms: ClassVar[dict[str, float]]
    """Weights of the reward terms by name; the task reward is the weighted sum."""
    stages: ClassVar[tuple[str, ...]]
    """Names of the stages on the way to success, in order, before HELD. An episode has reached a
    stage that held in any step. Names with the prefix END are causes of failure instead: one that
    holds ends the episode."""
    success_m: ClassVar[float]
    """Greatest error that counts as success, m."""
    evaluation: ClassVar[Evaluation] = Evaluation()

    @abstractmethod
    def goal_features(self, body: Body, target: Target) -> Tensor:
        """[n, goal.width]: goal features that the policy and the critic observe."""

    @abstractmethod
    def reward_terms(self, body: Body, target: Target) -> Tensor:
        """[n, len(terms)]: the unweighted reward terms, each in [0, 1] or [-1, 0]."""

    @abstractmethod
    def error_m(self, body: Body, target: Target) -> Tensor:
        """[n]: distance from completion, m; success up to `success_m`."""

    @abstractmethod
    def stage(self, body: Body, target: Target) -> Tensor:
        """[n, len(stages)] bool: the stages that hold in this step."""

    def low(self, body: Body, target: Target) -> Tensor:
        """[n] bool: where the task allows a low pelvis; elsewhere it ends a training episode early.
        By default nowhere."""
        return torch.zeros(len(body.root), dtype=torch.bool, device=body.root.device)

    @abstractmethod
    def fell(self, body: Body, target: Target) -> Tensor:
        """[n] bool: the episode ends in this step as a failure."""


def statistic(stage: str) -> str:
    """Name of a stage's statistic in the episodes of a shard."""
    return stage if stage.startswith(END) else f"stage_{stage}"
