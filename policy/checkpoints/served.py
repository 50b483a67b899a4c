"""A policy ready to be served: its network, what its actions mean, and where it comes from."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor, nn
from torch.nn import functional

from policy.checkpoints.format import Manifest
from policy.errors import LayoutError
from policy.model.acting import Policy
from world import tasks
from world.character import model as character
from world.character.actions import ActionMap
from world.character.features import STATE
from world.config import WorldConfig
from world.tasks import Task

StyleScore = Callable[[Tensor, Tensor], Tensor]
"""Style rewards [n] of transitions between states [n, 114] and [n, 114]."""

STATE_WIDTH, ACTIONS = STATE.width, character.NU


@dataclass(frozen=True)
class Served:
    """One version of one policy; never changed, only replaced."""

    name: str
    """What requests call it."""
    weights: Mapping[str, Tensor]
    """As `policy.model.acting.publish` gives them."""
    manifest: Manifest
    world: WorldConfig
    digest: str
    """SHA-256 of the weights' file."""
    sigma: float = 0.0
    """Standard deviation of sampled actions, in units of the action."""
    style: StyleScore | None = None
    """What the checkpoint's discriminator says, if it has one."""

    @cached_property
    def version(self) -> str:
        """Iteration and the first digits of the digest."""
        return f"{self.manifest.iteration}-{self.digest[:8]}"

    @cached_property
    def task(self) -> Task:
        """What the policy does."""
        return tasks.make(self.manifest.layout.task)

    @cached_property
    def action_map(self) -> ActionMap:
        """What its actions mean, float32."""
        return ActionMap.of(self.world.action_scale, self.world.action_clip, torch.float32)

    @cached_property
    def policy(self) -> Policy:
        """The network."""
        return Policy(self.weights)

    @cached_property
    def width(self) -> int:
        """Of (state, goal)."""
        return STATE_WIDTH + self.task.goal.width

    @cached_property
    def _layers(self) -> list[tuple[Tensor, Tensor]]:
        """Weights and biases: modules cost as much as the arithmetic of a small batch.

        Detached, so that nothing is recorded: inference mode would cost a lone row a tenth more.
        """
        linears = [m for m in self.policy.actor.layers if isinstance(m, nn.Linear)]
        return [(linear.weight.detach(), linear.bias.detach()) for linear in linears]

    @cached_property
    def _skip(self) -> Tensor | None:
        """Transposed matrix of the actor's linear map, if it has one, detached likewise."""
        skip = self.policy.actor.skip
        return None if skip is None else skip.weight.detach().T

    def act(self, observation: Tensor) -> Tensor:
        """Mean actions [n, 28] for rows of (state, goal) [n, width], float32."""
        rows, right = self.policy.network_input(observation)
        *hidden, (weight, bias) = self._layers
        inner = rows
        for matrix, offset in hidden:
            inner = functional.linear(inner, matrix, offset).relu_()
        means = functional.linear(inner, weight, bias)
        if self._skip is not None:
            means = torch.addmm(means, rows, self._skip)
        return self.policy.world_action(means, right)

    def check(self) -> "Served":
        """Itself, or LayoutError if it cannot act: its features, or numbers in its weights."""
        features = tuple((f.name, f.width) for f in STATE)
        goal = tuple((f.name, f.width) for f in self.task.goal)
        layout = self.manifest.layout
        if (layout.features, layout.goal, layout.actions) != (features, goal, ACTIONS):
            raise LayoutError(
                f"{self.name}: made for other features, goals or actions than {self.task.name} has"
            )
        if self.policy.mean.shape != (self.width,) or self.policy.actions != ACTIONS:
            raise LayoutError(f"{self.name}: its weights are of another size than its layout says")
        if not self.act(torch.zeros(1, self.width)).isfinite().all():
            raise LayoutError(f"{self.name}: its weights hold numbers that are not finite")
        return self
