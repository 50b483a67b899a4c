"""Adam with a state of plain tensors for checkpoints."""

from collections.abc import Iterable

import torch
from torch import Tensor, nn


def adam(parameters: Iterable[nn.Parameter], rate: float) -> torch.optim.Adam:
    """Fused Adam: one pass over the weights, the fastest of torch's three variants on a CPU.

    Its rate is a tensor on the parameters' device, so that a recorded step (world.graphs) follows
    it.
    """
    held = list(parameters)
    device = held[0].device
    recorded = device.type == "cuda"
    # float64 where the kernel takes it: the CPU's numbers are those of a rate in Python
    kind = torch.float32 if recorded else torch.float64
    lr = torch.tensor(rate, dtype=kind, device=device)
    made = torch.optim.Adam(held, lr=lr, fused=True, capturable=recorded)
    # else torch remarks the first steps, which are not recorded
    made._warned_capturable_if_run_uncaptured = True  # type: ignore[attr-defined]
    return made


def set_rate(optimiser: torch.optim.Optimizer, rate: float | Tensor) -> None:
    """Set the learning rate of all parameters, in place."""
    for group in optimiser.param_groups:
        if isinstance(rate, Tensor):
            group["lr"].copy_(rate)
        else:
            group["lr"].fill_(rate)


def step_count(optimiser: torch.optim.Optimizer) -> Tensor:
    """[] float64: number of gradient steps so far, on the device; nothing is waited for."""
    for entry in optimiser.state.values():
        return entry["step"].double()
    return torch.zeros((), dtype=torch.float64, device=optimiser.param_groups[0]["lr"].device)


def descend(
    network: nn.Module,
    optimiser: torch.optim.Optimizer,
    loss: Tensor,
    grad_norm: float,
    skip: Tensor | None = None,
) -> None:
    """One gradient step, with gradients scaled down to `grad_norm`.

    skip: [] bool, on the device; where it holds, weights, moments and step count stay.
    """
    optimiser.zero_grad(set_to_none=True)
    loss.backward()
    nn.utils.clip_grad_norm_(network.parameters(), grad_norm, foreach=True)
    # fused Adam's own switch, made for gradients that overflow
    optimiser.found_inf = None if skip is None else skip.float()  # type: ignore[attr-defined]
    optimiser.step()


def steps_taken(optimiser: torch.optim.Optimizer) -> int:
    """Number of gradient steps so far."""
    return max((int(entry["step"]) for entry in optimiser.state.values()), default=0)


def adam_state(optimiser: torch.optim.Optimizer) -> dict[str, dict[str, Tensor]]:
    """Moments and step counts by parameter number; empty before the first step."""
    state = optimiser.state_dict()["state"]
    return {str(k): {name: v.clone() for name, v in entry.items()} for k, entry in state.items()}


def load_adam_state(optimiser: torch.optim.Optimizer, state: dict[str, dict[str, Tensor]]) -> None:
    """Restore an `adam_state`; the learning rates stay."""
    groups = optimiser.state_dict()["param_groups"]
    rates = [group["lr"] for group in optimiser.param_groups]
    entries = {int(k): {name: v.clone() for name, v in entry.items()} for k, entry in state.items()}
    optimiser.load_state_dict({"state": entries, "param_groups": groups})
    for group, rate in zip(optimiser.param_groups, rates, strict=True):
        group["lr"] = rate  # not the copy that torch makes
