"""Adam in torch's fused kernel, without the second of a core that `torch.optim` costs at first use.

Making any of torch's optimisers imports its compiler (800 modules), which nothing here uses and
which a process that has to be back soon cannot afford.
"""

from collections.abc import Iterable, Mapping

import torch
from torch import Tensor, nn

BETAS = 0.9, 0.999
EPSILON = 1e-8


class Adam:
    """Bit for bit `torch.optim.Adam(parameters, lr=rate, fused=True)`, on one device."""

    def __init__(self, parameters: Iterable[nn.Parameter], rate: float) -> None:
        self.parameters = list(parameters)
        self.rate = rate
        self.state: dict[str, dict[str, Tensor]] = {}
        """step, exp_avg and exp_avg_sq by a parameter's number; none before its first gradient"""

    def zero_grad(self) -> None:
        """Forget the gradients."""
        for parameter in self.parameters:
            parameter.grad = None

    @torch.no_grad()
    def step(self) -> None:
        """One gradient step of every parameter that has a gradient."""
        moved = [(str(i), p, p.grad) for i, p in enumerate(self.parameters) if p.grad is not None]
        if not moved:
            return
        for index, parameter, _ in moved:
            if index not in self.state:
                self.state[index] = {
                    "step": torch.zeros((), dtype=torch.float32, device=parameter.device),
                    "exp_avg": torch.zeros_like(parameter),
                    "exp_avg_sq": torch.zeros_like(parameter),
                }
        steps, means, squares = (
            [self.state[index][name] for index, _, _ in moved]
            for name in ("step", "exp_avg", "exp_avg_sq")
        )
        torch._foreach_add_(steps, 1)
        torch._fused_adam_(
            [parameter for _, parameter, _ in moved],
            [gradient for _, _, gradient in moved],
            means,
            squares,
            [],
            steps,
            lr=self.rate,
            beta1=BETAS[0],
            beta2=BETAS[1],
            weight_decay=0.0,
            eps=EPSILON,
            amsgrad=False,
            maximize=False,
        )

    def steps_taken(self) -> int:
        """Gradient steps so far."""
        return max((int(entry["step"]) for entry in self.state.values()), default=0)

    def state_dict(self) -> dict[str, dict[str, Tensor]]:
        """A copy of `state`: plain tensors, as checkpoints hold them."""
        return {i: _copied(entry) for i, entry in self.state.items()}

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Restore what `state_dict` gave; the rate stays as it is."""
        self.state = {i: _copied(entry) for i, entry in state.items()}


def _copied(entry: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {name: value.detach().clone() for name, value in entry.items()}
