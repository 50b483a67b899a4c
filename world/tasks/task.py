"""What a task is: a goal, named weighted reward terms, success, stages and termination, on tensors
of scenes; what its object offers; how it is evaluated."""

from abc import ABC, abstractmethod
from typing import ClassVar

import torch
from torch import Tensor

from world.affordances import Affordance
from world.character.features import Body, Table
from world.scene.target import Target
from world.tasks.evaluation import Evaluation

#: Name of the last stage of every task: success held. Whoever runs the episodes knows it, since
#: `stage` sees a moment alone.
HELD = "held"


class Task(ABC):
    """One thing to do with an object; all tensors are float32 over n scenes."""

    name: ClassVar[str]
    affordance: ClassVar[Affordance]
    """What the object must offer: the kind of object, of world.affordances. It brings the training
    objects, initial states, trials, and what is learned of clips."""
    episode_s: ClassVar[float] = 10.0
    """Length of a training episode, s."""
    goal: ClassVar[Table]
    alike: ClassVar[dict[str, str]] = {}
    """Goal features that mean to a policy what another name means in other tasks: by these, and by
    equal names, one task's networks begin as another's."""
    sides: ClassVar[tuple[str, str] | None] = None
    """Two goal features whose first numbers are directions on the floor: where the second points to
    the right of the first, the networks see the scene mirrored, and so know one side alone. Both
    must last an episode, but for the heading they are seen from. None: nothing is mirrored."""
    terms: ClassVar[dict[str, float]]
    """Reward terms by name, with their weights: the task's reward is the weighted sum."""
    stages: ClassVar[tuple[str, ...]]
    """What leads to success, in order; an episode has reached a stage that was true once. After
    them comes HELD."""
    success_m: ClassVar[float]
    """Success is an error of at most this, m."""
    evaluation: ClassVar[Evaluation] = Evaluation()

    @abstractmethod
    def goal_features(self, body: Body, target: Target) -> Tensor:
        """[n, goal.width]: what the policy and the value function see of the goal."""

    @abstractmethod
    def reward_terms(self, body: Body, target: Target) -> Tensor:
        """[n, len(terms)]: the terms, unweighted, each in [0, 1] or [-1, 0]."""

    @abstractmethod
    def error_m(self, body: Body, target: Target) -> Tensor:
        """[n]: how far from done, m; success is being within `success_m`."""

    @abstractmethod
    def stage(self, body: Body, target: Target) -> Tensor:
        """[n, len(stages)] bool: which stages hold at this moment."""

    def low(self, body: Body, target: Target) -> Tensor:
        """[n] bool: where the task takes the pelvis down; elsewhere a low pelvis ends a training
        episode early. By default nowhere."""
        return torch.zeros(len(body.root), dtype=torch.bool)

    @abstractmethod
    def fell(self, body: Body, target: Target) -> Tensor:
        """[n] bool: the episode ends here as a failure."""
