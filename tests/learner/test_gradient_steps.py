"""A step of actor or critic by hand, and what its numbers say."""

import pytest
import torch

from learner.gradient_steps import NUMBERS, RAMP_STEPS, ActorStep, ActorSteps, CriticStep
from learner.optimiser import adam, step_count
from policy.model.networks import Actor, Critic
from tests.support.learning.learners import CONFIG
from world.precision import FLOAT32


def rows(n: int) -> tuple[torch.Tensor, ...]:
    draw = torch.Generator().manual_seed(0)
    return tuple(torch.randn(n, width, generator=draw) for width in (6, 2))


def test_a_critic_step_is_one_of_adam_on_the_mean_squared_error() -> None:
    critic, (observations, wanted) = Critic(6, (8, 8)), rows(20)
    targets = wanted[:, 0]
    step = CriticStep(critic, adam(critic.parameters(), 1e-3), CONFIG, FLOAT32)
    before = [p.detach().clone() for p in critic.parameters()]
    loss = step(observations, targets)
    with torch.no_grad():
        for p, value in zip(critic.parameters(), before, strict=True):
            change, gradient = p - value, p.grad
            assert gradient is not None
            # the first step of Adam is the rate, against the gradient's sign
            large = gradient.abs() > 1e-4
            assert torch.allclose(change[large], -1e-3 * gradient[large].sign(), atol=1e-5)
            p.copy_(value)
        assert float(loss) == pytest.approx(float((critic(observations) - targets).square().mean()))


def test_an_actor_step_beyond_the_limit_changes_nothing_and_says_so() -> None:
    actor, (observations, actions) = Actor(6, 2, (8, 8), False), rows(20)
    step = ActorStep(actor, adam(actor.parameters(), 1.0), CONFIG, FLOAT32)
    old, gains = torch.ones(20, 2), torch.ones(20)
    before = [p.detach().clone() for p in actor.parameters()]

    def taken(limit: float) -> dict[str, float]:
        settings = torch.tensor([0.5, 0.2, limit, 0.04, 0.0], dtype=torch.float64)
        fixed = (observations, actions, old, torch.zeros(20), gains, None, None, None, None)
        return dict(zip(NUMBERS, step(settings, *fixed).tolist(), strict=True))

    with torch.no_grad():
        kl = float(0.5 * (actor(observations) - 1.0).square().sum(-1).mean() / 0.25)
    far = taken(0.9 * kl)
    assert far["skipped"] == 1.0 and far["kl"] == pytest.approx(kl, rel=1e-5)
    assert all(map(torch.equal, before, actor.parameters()))
    assert step_count(step.optimiser) == 0
    near = taken(1.1 * kl)
    assert near["skipped"] == 0.0 and step_count(step.optimiser) == 1
    largest = max(
        float((p - b).abs().max().detach()) for p, b in zip(actor.parameters(), before, strict=True)
    )
    assert largest == pytest.approx(0.04 / RAMP_STEPS, rel=1e-3), "the first rate of the ramp"


def test_means_are_of_the_steps_that_were_taken() -> None:
    one = torch.tensor([1.0, 0.0, 2.0, 3.0, 4.0, 5.0, 0.5], dtype=torch.float64)
    skipped = torch.tensor([9.0, 1.0, 7.0, 7.0, 7.0, 7.0, 7.0], dtype=torch.float64)
    found = ActorSteps([one, skipped, 3.0 * one])
    assert found.skipped == 1
    assert found.mean("surrogate") == 4.0 and found.mean("clipped") == 1.0
    assert found.kl(2) == 6.0, "of all"
    assert ActorSteps([]).mean("bound") == 0.0
