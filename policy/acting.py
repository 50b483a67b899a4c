"""What acts: an actor and its normaliser rebuilt from published weights."""

from collections.abc import Mapping

import torch
from torch import Tensor

from policy.networks import Actor, hidden_widths
from policy.normaliser import Normaliser, normalise
from world.precision import FLOAT32, Precision

ACTOR, NORMALISER = "actor.", "normaliser."


def publish(actor: Actor, normaliser: Normaliser) -> dict[str, Tensor]:
    """Copies of the actor's weights and its normaliser, flat, ready to be sent."""
    weights = {f"{ACTOR}{k}": v.detach().clone() for k, v in actor.state_dict().items()}
    return weights | {f"{NORMALISER}{k}": v for k, v in normaliser.published().items()}


class Policy:
    """Mean actions from states and goals; rebuilt or refilled from published weights."""

    def __init__(self, weights: Mapping[str, Tensor], precision: Precision = FLOAT32) -> None:
        self.precision = precision
        inputs, self.actions, hidden = hidden_widths(dict(weights), ACTOR)
        self.actor = Actor(inputs, self.actions, hidden)
        self.load(weights)

    def load(self, weights: Mapping[str, Tensor]) -> None:
        """Take newer weights of the same shapes."""
        own = {k.removeprefix(ACTOR): v for k, v in weights.items() if k.startswith(ACTOR)}
        self.actor.load_state_dict(own)
        self.mean = weights[f"{NORMALISER}mean"]
        self.std = weights[f"{NORMALISER}std"]
        self.clip = float(weights[f"{NORMALISER}clip"])

    @torch.no_grad()
    def __call__(self, state: Tensor, goal: Tensor) -> Tensor:
        """State [n, 114] and goal [n, G] -> mean action [n, 28], float32."""
        observation = normalise(torch.cat((state, goal), -1), self.mean, self.std, self.clip)
        with self.precision.context():
            return self.actor(observation)
