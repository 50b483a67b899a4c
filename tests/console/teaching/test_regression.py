"""Labelled samples, and what the loss weighs."""

import torch

from console.run import assembly
from console.run.experiment import Experiment
from console.teaching.regression import Regression, Samples, action_weights
from learner.config import LearnerConfig
from world.config import WorldConfig


def test_samples_keep_the_newest() -> None:
    samples = Samples(8, 3, torch.device("cpu"))
    for k in range(3):
        samples.add(torch.full((5, 3), float(k)), torch.full((5, 28), float(k)))
    assert samples.total == 15
    kept = samples.observations[:, 0].sort().values.tolist()
    assert kept == [1.0] * 3 + [2.0] * 5
    assert torch.equal(samples.teacher_actions[:, 0], samples.observations[:, 0])
    observations, actions = samples.draw(64)
    assert torch.equal(observations[:, 0], actions[:, 0])
    assert (observations[::2, 0] == 2.0).all(), "half of them from the newest third"


def test_a_policy_of_another_task_acts_as_before_while_its_normaliser_moves() -> None:
    experiment = Experiment(ppo=LearnerConfig(hidden=(16, 8), observation_clip=100.0))
    learner = assembly.learner(experiment)
    draw = torch.Generator().manual_seed(0)
    width = assembly.layout(experiment).observation
    learner.normaliser.update(torch.randn(500, width, generator=draw))
    learner.normaliser.count[-3:] = 0.0  # features that the other task lacks
    with torch.no_grad():
        learner.actor.layers[0].weight[:, -3:] = 0.0
        learner.actor.head.weight.mul_(100.0)
    observations = 0.4 + 1.3 * torch.randn(500, width, generator=draw)
    before = learner.actor(learner.normaliser(observations)).detach()
    regression = Regression(learner, torch.ones(28), 1e-3, 64)
    regression.begin(observations, torch.zeros(500, 28))
    mean = learner.normaliser.mean
    assert float((mean[:-3] - 0.2).abs().mean()) < 0.1 and float(mean[-3:].mean()) > 0.3
    seen = learner.normaliser(observations)
    for actor in (regression.actor, regression.average):
        torch.testing.assert_close(actor(seen), before, atol=1e-5, rtol=1e-5)
    learner.close()


def test_actions_are_weighed_by_their_torque() -> None:
    weights = action_weights(WorldConfig(task="carry"))
    assert weights.shape == (28,)
    assert float(weights.min()) >= 0.3 and float(weights.max()) <= 3.0
    assert float(weights.max() / weights.min()) > 2.0
    # the reach of all actions is the same factor: it weighs nothing
    torch.testing.assert_close(weights, action_weights(WorldConfig(action_scale=0.7)))
