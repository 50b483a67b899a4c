"""Parts of the benches: what is repeated, and rollouts that are made up."""

import math
from dataclasses import replace

import torch

from console.bench.command import made_up, repeated, warmed
from console.commands import Bench
from console.run.experiment import PRESETS

EXPERIMENT = replace(PRESETS["fast"], scenes=16, horizon=4)


def test_a_made_up_rollout_is_one_of_its_policy() -> None:
    rollout = made_up(EXPERIMENT)
    assert rollout.states.shape == (5, 16, 114) and rollout.actions.shape == (4, 16, 28)
    assert rollout.valid.all() and not (rollout.fell | rollout.timed_out).any()
    sigma = EXPERIMENT.ppo.sigma[0][1]
    density = torch.distributions.Normal(rollout.means, sigma).log_prob(rollout.actions).sum(-1)
    torch.testing.assert_close(rollout.log_probs, density, atol=2e-3, rtol=0)
    assert torch.equal(made_up(EXPERIMENT).states, rollout.states)


def test_a_call_is_repeated_five_times_at_least() -> None:
    calls = []
    assert repeated(lambda: calls.append(1), Bench("learner", seconds=0.0)) >= 0.0
    assert len(calls) == 6, "the first one warms up"


def test_nothing_but_the_warm_up_is_left_out() -> None:
    found = warmed(EXPERIMENT)
    assert found.ppo.warmup_iterations == 0 and EXPERIMENT.ppo.warmup_iterations > 0
    assert replace(found, ppo=EXPERIMENT.ppo) == EXPERIMENT
    assert math.isclose(found.ppo.gamma, EXPERIMENT.ppo.gamma)
