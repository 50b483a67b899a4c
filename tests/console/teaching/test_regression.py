"""Labelled samples, and what the loss weighs."""

import torch

from console.teaching.regression import Samples, action_weights
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


def test_actions_are_weighed_by_their_torque() -> None:
    weights = action_weights(WorldConfig(task="carry"))
    assert weights.shape == (28,)
    assert float(weights.min()) >= 0.3 and float(weights.max()) <= 3.0
    assert float(weights.max() / weights.min()) > 2.0
    # the reach of all actions is the same factor: it weighs nothing
    torch.testing.assert_close(weights, action_weights(WorldConfig(action_scale=0.7)))
