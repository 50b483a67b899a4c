"""Network of the discriminator: a ReLU perceptron from a normalised transition to one logit."""

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional


class StyleNetwork(nn.Module):
    """D(s, s') as a logit; its initial weights are drawn from `generator`."""

    def __init__(self, inputs: int, hidden: tuple[int, ...], generator: torch.Generator) -> None:
        """inputs: width 2 F of a transition. hidden: widths of the ReLU layers."""
        super().__init__()
        widths = (inputs, *hidden, 1)
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        with torch.no_grad():
            for layer in self.linears:
                # Uniform in +-1/sqrt(fan in), torch's default, but from this generator. The small
                # output layer makes the initial logits about 0 and the first rewards log 2.
                bound = layer.in_features**-0.5
                scale = 0.1 if layer.out_features == 1 else 1.0
                layer.weight.uniform_(-bound * scale, bound * scale, generator=generator)
                layer.bias.zero_()

    @property
    def linears(self) -> list[nn.Linear]:
        """The linear layers, input to output."""
        return [layer for layer in self.layers if isinstance(layer, nn.Linear)]

    def forward(self, x: Tensor) -> Tensor:
        """Logits [n] of normalised transitions x [n, 2F]."""
        return self.with_activations(x)[0]

    def with_activations(self, x: Tensor) -> tuple[Tensor, list[Tensor]]:
        """Logits [n], and the hidden activations [n, width], whose signs are the ReLU masks.

        Under autocast the output layer still computes in float32: a logit needs more than eight
        bits.
        """
        *body, head = self.linears
        hidden: list[Tensor] = []
        for layer in body:
            x = functional.relu(functional.linear(x, layer.weight, layer.bias), inplace=True)
            hidden.append(x)
        with torch.autocast(x.device.type, enabled=False):
            return functional.linear(x.to(head.weight.dtype), head.weight, head.bias).squeeze(
                -1
            ), hidden

    def input_gradient(self, hidden: list[Tensor]) -> Tensor:
        """Gradient d logit / d x [n, 2F], in closed form from the ReLU masks of `hidden`.

        The masks are constant almost everywhere, so one backward pass through this product of
        matrices replaces a double backward pass.
        """
        *body, head = self.linears
        gradient = head.weight
        for layer, activation in zip(reversed(body), reversed(hidden), strict=True):
            gradient = (gradient * (activation.detach() > 0)) @ layer.weight
        return gradient.to(head.weight.dtype)
