"""Actor and critic: separate ReLU perceptrons of the normalised state and goal."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn

# Makes the initial mean action about zero, which is the mean mocap pose.
ACTOR_OUTPUT_GAIN = 0.01


def perceptron(
    inputs: int, hidden: Sequence[int], outputs: int, output_gain: float
) -> nn.Sequential:
    """Linear layers with ReLU between them; orthogonal initial weights, zero biases."""
    widths = [inputs, *hidden, outputs]
    layers: list[nn.Module] = []
    for k, (fan_in, fan_out) in enumerate(pairwise(widths)):
        last = k == len(hidden)
        linear = nn.Linear(fan_in, fan_out)
        nn.init.orthogonal_(linear.weight, gain=output_gain if last else 2.0**0.5)
        nn.init.zeros_(linear.bias)
        layers += [linear] if last else [linear, nn.ReLU()]
    return nn.Sequential(*layers)


def evaluate(layers: nn.Sequential, x: Tensor) -> Tensor:
    """Output of the layers, in the ambient precision except for the last, which is in float32.

    Rounding to eight bits changes a mean action by up to a fifth of its noise, and a value by more
    than a reward.
    """
    *body, head = layers
    for layer in body:
        x = layer(x)
    with torch.autocast(x.device.type, enabled=False):
        return head(x.float())


class Actor(nn.Module):
    """Mean of the Gaussian policy, in units of the normalised action."""

    def __init__(
        self, inputs: int, actions: int, hidden: Sequence[int] = (512, 256), skip: bool = False
    ) -> None:
        """skip: add a linear map from the observation to the output, initially 0."""
        super().__init__()
        self.layers = perceptron(inputs, hidden, actions, ACTOR_OUTPUT_GAIN)
        # Set-points are near the present joint positions; the map takes this part off the layers.
        self.skip = nn.Linear(inputs, actions, bias=False) if skip else None
        if self.skip is not None:
            nn.init.zeros_(self.skip.weight)

    @property
    def head(self) -> nn.Linear:
        """The last layer."""
        return _head(self.layers)

    @property
    def actions(self) -> int:
        """Width of an action."""
        return self.head.out_features

    @staticmethod
    def like(weights: Mapping[str, Tensor], prefix: str = "") -> "Actor":
        """A new actor of the shape of these weights."""
        inputs, actions, hidden = hidden_widths(weights, prefix)
        return Actor(inputs, actions, hidden, f"{prefix}skip.weight" in weights)

    def forward(self, observation: Tensor) -> Tensor:
        """Mean actions [n, actions] of normalised (state, goal) [n, inputs]."""
        means = evaluate(self.layers, observation)
        if self.skip is None:
            return means
        with torch.autocast(observation.device.type, enabled=False):
            return means + self.skip(observation.float())


class Critic(nn.Module):
    """Expected discounted return, in units of the value normaliser."""

    def __init__(self, inputs: int, hidden: Sequence[int] = (512, 256)) -> None:
        super().__init__()
        self.layers = perceptron(inputs, hidden, 1, 1.0)

    @property
    def head(self) -> nn.Linear:
        """The last layer, rescaled when the value normaliser moves."""
        return _head(self.layers)

    def forward(self, observation: Tensor) -> Tensor:
        """Normalised values [n] of normalised (state, goal) [n, inputs]."""
        return evaluate(self.layers, observation).squeeze(-1)


def _head(layers: nn.Sequential) -> nn.Linear:
    last = layers[-1]
    assert isinstance(last, nn.Linear)
    return last


def hidden_widths(
    weights: Mapping[str, Tensor], prefix: str = ""
) -> tuple[int, int, tuple[int, ...]]:
    """(inputs, outputs, hidden widths) of a perceptron, read from its weights' shapes."""
    keys = [k for k in weights if k.startswith(f"{prefix}layers.") and k.endswith(".weight")]
    keys.sort(key=lambda k: int(k.removeprefix(f"{prefix}layers.").split(".")[0]))
    shapes = [weights[k].shape for k in keys]
    return shapes[0][1], shapes[-1][0], tuple(int(s[0]) for s in shapes[:-1])


def log_density(actions: Tensor, means: Tensor, sigma: float | Tensor) -> Tensor:
    """Log-density of a Gaussian with one fixed sigma: [.., a], [.., a] -> [..], float32.

    sigma: a number, or [] where it must not be known in Python (world.graphs).
    """
    width = actions.shape[-1]
    scaled = (actions - means.float()) / sigma
    log_sigma = sigma.log() if isinstance(sigma, Tensor) else math.log(sigma)
    constant = width * (log_sigma + 0.5 * math.log(2.0 * math.pi))
    return -0.5 * scaled.square().sum(-1) - constant
