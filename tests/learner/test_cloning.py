"""A clone acts as its teacher."""

import torch

from learner.cloning import clone
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser


def test_a_clone_acts_as_its_teacher():
    torch.manual_seed(0)
    inputs = torch.randn(4096, 6) * 3 + 1
    targets = torch.stack((inputs[:, 0] - inputs[:, 1], inputs[:, 2]), 1) * 0.2
    actor, normaliser = Actor(6, 2, (32, 32)), Normaliser(6)
    errors = clone(actor, normaliser, inputs, targets, passes=8, rate=3e-3, minibatch=256)
    assert errors[-1] < 0.02 * float(targets.var()) and errors[-1] < errors[0]
    torch.testing.assert_close(normaliser.mean.float(), inputs.mean(0))
