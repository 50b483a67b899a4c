"""What acts: an actor and its normaliser rebuilt from published weights."""

from collections.abc import Mapping

import torch
from torch import Tensor

from policy.model.networks import Actor
from policy.model.normaliser import Normaliser, normalise
from world.device import CPU, put
from world.precision import FLOAT32, Precision
from world.reflection import Symmetry

ACTOR, NORMALISER, SYMMETRY = "actor.", "normaliser.", "symmetry."


def publish(
    actor: Actor, normaliser: Normaliser, symmetry: Symmetry | None = None
) -> dict[str, Tensor]:
    """Copies of the actor's weights, its normaliser and, where it knows one side alone, what the
    other is; flat, ready to be sent."""
    weights = {f"{ACTOR}{k}": v.detach().clone() for k, v in actor.state_dict().items()}
    sides = {} if symmetry is None else symmetry.tensors()
    return (
        weights
        | {f"{NORMALISER}{k}": v for k, v in normaliser.published().items()}
        | {f"{SYMMETRY}{k}": v for k, v in sides.items()}
    )


class Policy:
    """Mean actions from states and goals; rebuilt or refilled from published weights."""

    def __init__(
        self,
        weights: Mapping[str, Tensor],
        precision: Precision = FLOAT32,
        device: torch.device = CPU,
    ) -> None:
        self.precision = precision
        self.device = device
        self.actor = Actor.like(weights, ACTOR).to(device)
        self.actions = self.actor.actions
        self.load(weights)

    def load(self, weights: Mapping[str, Tensor]) -> None:
        """Take newer weights of the same shapes, from any device."""
        weights = {name: put(tensor, self.device) for name, tensor in weights.items()}
        self.actor.load_state_dict(_part(weights, ACTOR))
        self.symmetry = Symmetry.of(_part(weights, SYMMETRY))
        self.mean = weights[f"{NORMALISER}mean"]
        self.std = weights[f"{NORMALISER}std"]
        self.clip = float(weights[f"{NORMALISER}clip"])

    @torch.no_grad()
    def __call__(self, state: Tensor, goal: Tensor) -> Tensor:
        """State [n, 114] and goal [n, G] -> mean action [n, 28], float32."""
        observation, right = self.seen(torch.cat((state, goal), -1))
        with self.precision.context():
            return self.done(self.actor(observation), right)

    def seen(self, observation: Tensor) -> tuple[Tensor, Tensor | None]:
        """What the actor sees of observations [n, d]: their images in the mirror where [n] bool,
        returned too, says so; normalised."""
        right = None
        if self.symmetry is not None:
            observation, right = self.symmetry.seen(observation)
        return normalise(observation, self.mean, self.std, self.clip), right

    def done(self, action: Tensor, right: Tensor | None) -> Tensor:
        """What is to be done where the actor said `action` [n, 28] to what `seen` gave."""
        return action if self.symmetry is None else self.symmetry.done(action, right)


def _part(weights: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {k.removeprefix(prefix): v for k, v in weights.items() if k.startswith(prefix)}
