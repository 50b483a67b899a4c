"""A policy for acting: actor, normaliser and symmetry from published weights."""

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
    actor: Actor,
    normaliser: Normaliser,
    symmetry: Symmetry | None = None,
    hidden: Tensor | None = None,
) -> dict[str, Tensor]:
    """Flat copies of the weights of an actor, its normaliser and its symmetry, ready to be sent.

    hidden: [d] bool: observations that the actor does not see: it gets 0 in their place.
    """
    weights = {f"{ACTOR}{k}": v.detach().clone() for k, v in actor.state_dict().items()}
    sides = {} if symmetry is None else symmetry.tensors()
    return (
        weights
        | {f"{NORMALISER}{k}": v for k, v in _seen(normaliser, hidden).items()}
        | {f"{SYMMETRY}{k}": v for k, v in sides.items()}
    )


def _seen(normaliser: Normaliser, hidden: Tensor | None) -> dict[str, Tensor]:
    """What the normaliser publishes; division by infinity gives 0 for what is hidden."""
    found = normaliser.published()
    if hidden is not None:
        found["mean"] = found["mean"].masked_fill(hidden, 0.0)
        found["std"] = found["std"].masked_fill(hidden, torch.inf)
    return found


class Policy:
    """Mean actions from states and goals, with published weights."""

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
        """Load weights of the same shapes, from any device."""
        weights = {name: put(tensor, self.device) for name, tensor in weights.items()}
        self.actor.load_state_dict(_part(weights, ACTOR))
        self.symmetry = Symmetry.of(_part(weights, SYMMETRY))
        self.mean = weights[f"{NORMALISER}mean"]
        self.std = weights[f"{NORMALISER}std"]
        self.clip = float(weights[f"{NORMALISER}clip"])

    @torch.no_grad()
    def __call__(self, state: Tensor, goal: Tensor) -> Tensor:
        """Mean actions [n, 28], float32, of states [n, 114] and goals [n, G]."""
        observation, right = self.network_input(torch.cat((state, goal), -1))
        with self.precision.context():
            return self.world_action(self.actor(observation), right)

    def network_input(self, observation: Tensor) -> tuple[Tensor, Tensor | None]:
        """Normalised input of the actor for observations [n, d], on the canonical side.

        Returns also [n] bool: where the input is the mirror image (None: nowhere).
        """
        right = None
        if self.symmetry is not None:
            observation, right = self.symmetry.canonical(observation)
        return normalise(observation, self.mean, self.std, self.clip), right

    def world_action(self, action: Tensor, right: Tensor | None) -> Tensor:
        """Actions [n, 28] in the world from the actor's, with the mask of `network_input`."""
        return action if self.symmetry is None else self.symmetry.restored(action, right)


def _part(weights: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {k.removeprefix(prefix): v for k, v in weights.items() if k.startswith(prefix)}
