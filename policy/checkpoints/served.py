"""One version of a served policy: network, action map, manifest and digest."""

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
    """One version of one policy; immutable, a reload replaces it."""

    name: str
    """Name of the policy in requests."""
    weights: Mapping[str, Tensor]
    """Published weights, as of `policy.model.acting.publish`."""
    manifest: Manifest
    world: WorldConfig
    digest: str
    """SHA-256 of the weights' file."""
    sigma: float = 0.0
    """Standard deviation of sampled actions, in units of the action."""
    style: StyleScore | None = None
    """Style reward of the checkpoint's discriminator, if it has one."""

    @cached_property
    def version(self) -> str:
        """Name of the version: iteration and first digits of the digest."""
        return f"{self.manifest.iteration}-{self.digest[:8]}"

    @cached_property
    def task(self) -> Task:
        """Task of the policy."""
        return tasks.make(self.manifest.layout.task)

    @cached_property
    def action_map(self) -> ActionMap:
        """Map from actions to set-points, float32."""
        return ActionMap.of(self.world.action_scale, self.world.action_clip, torch.float32)

    @cached_property
    def policy(self) -> Policy:
        """Network of the policy."""
        return Policy(self.weights)

    @cached_property
    def width(self) -> int:
        """Width of the observation (state, goal)."""
        return STATE_WIDTH + self.task.goal.width

    @cached_property
    def _layers(self) -> list[tuple[Tensor, Tensor]]:
        """Weights and biases of the layers.

        Module calls cost as much as the arithmetic of a small batch. The tensors are detached so
        that autograd records nothing; inference mode would cost a single row a tenth more.
        """
        linears = [m for m in self.policy.actor.layers if isinstance(m, nn.Linear)]
        return [(linear.weight.detach(), linear.bias.detach()) for linear in linears]

    @cached_property
    def _skip(self) -> Tensor | None:
        """Transposed matrix of the actor's linear map, detached; None without one."""
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
        """Return itself; raise LayoutError for features, shapes or weights that cannot act."""
        # set-points are relative to a reference, which neither messages nor an ONNX file hold
        if self.task.affordance.follows_clips:
            raise LayoutError(
                f"{self.name}: a policy that follows clips is neither served nor exported; "
                "use evaluate, play or video"
            )
        features = tuple((f.name, f.width) for f in STATE)
        goal = tuple((f.name, f.width) for f in self.task.goal)
        layout = self.manifest.layout
        if (layout.features, layout.goal, layout.actions) != (features, goal, ACTIONS):
            raise LayoutError(
                f"{self.name}: made for other features, goals or actions than {self.task.name} has"
            )
        if self.policy.mean.shape != (self.width,) or self.policy.actions != ACTIONS:
            raise LayoutError(f"{self.name}: its weights differ in size from its layout")
        if not self.act(torch.zeros(1, self.width)).isfinite().all():
            raise LayoutError(f"{self.name}: its weights hold numbers that are not finite")
        return self
