"""Adam against its formula, and its state there and back."""

import pytest
import torch

from learner.optimiser import adam, adam_state, load_adam_state, set_rate, steps_taken


def one(value: float) -> tuple[torch.nn.Parameter, torch.optim.Adam]:
    weight = torch.nn.Parameter(torch.tensor([value]))
    return weight, adam([weight], 0.1)


def descend(weight: torch.nn.Parameter, optimiser: torch.optim.Adam, gradient: float) -> None:
    weight.grad = torch.tensor([gradient])
    optimiser.step()


def test_steps_by_hand() -> None:
    weight, optimiser = one(1.0)
    assert steps_taken(optimiser) == 0 and adam_state(optimiser) == {}
    descend(weight, optimiser, 4.0)
    assert weight.item() == pytest.approx(0.9, abs=1e-6), "the first step is the rate"
    set_rate(optimiser, 0.01)
    descend(weight, optimiser, -4.0)
    # m = 0.9*0.4 - 0.1*4 over 1 - 0.9^2; v = 0.999*0.016 + 0.016 over 1 - 0.999^2
    m, v = (0.9 * 0.4 - 0.4) / (1 - 0.81), (0.999 * 0.016 + 0.016) / (1 - 0.999**2)
    assert weight.item() == pytest.approx(0.9 - 0.01 * m / v**0.5, abs=1e-6)
    assert steps_taken(optimiser) == 2


def test_a_restored_state_goes_on_to_the_same_bits() -> None:
    weight, optimiser = one(1.0)
    descend(weight, optimiser, 2.0)
    other, again = one(weight.item())
    load_adam_state(again, adam_state(optimiser))
    for gradient in (1.0, -3.0):
        descend(weight, optimiser, gradient)
        descend(other, again, gradient)
    assert torch.equal(weight, other) and steps_taken(again) == 3


def test_a_kept_state_does_not_follow_the_optimiser() -> None:
    weight, optimiser = one(1.0)
    descend(weight, optimiser, 2.0)
    kept = adam_state(optimiser)["0"]["exp_avg"].clone()
    state = adam_state(optimiser)
    descend(weight, optimiser, 5.0)
    assert torch.equal(state["0"]["exp_avg"], kept)
