"""The discriminator on another device: the same rewards and the same state."""

import torch

from discriminator.trainer import Discriminator
from policy.checkpoints.format import flatten
from tests.discriminator.test_trainer import discriminator, iterate
from tests.support.stand_in_gpu import There, stand_in_gpu
from tests.support.style_cases import SMALL, Mocap, rollout
from world.precision import FLOAT32


def test_rewards_training_and_state_on_the_stand_in_are_the_cpus() -> None:
    here = Discriminator(SMALL, Mocap(), 0, precision=FLOAT32)
    wanted = iterate(here, 0, 7)
    assert here.replay.size == SMALL.replay, "the memory is full: rows are overwritten"
    with stand_in_gpu() as gpu:
        there = Discriminator(SMALL, Mocap(), 0, precision=FLOAT32, device=gpu)
        assert isinstance(there.replay.rows, There)
        found = iterate(there, 0, 7)
        for a, b in zip(wanted, found, strict=True):
            assert not isinstance(b, There), "rewards are where the rollout was"
            assert torch.equal(a, b)
        tensors, _ = flatten(there.state_dict())
    state, _ = flatten(here.state_dict())
    assert tensors.keys() == state.keys()
    for name, tensor in state.items():
        assert torch.equal(tensor, tensors[name]), name


def test_a_state_of_the_cpu_goes_on_on_the_stand_in() -> None:
    here = discriminator()
    here.precision = FLOAT32
    iterate(here, 0, 3)
    state = here.state_dict()
    wanted = here.score(3, **rollout(3)).reward
    with stand_in_gpu() as gpu:
        there = Discriminator(SMALL, Mocap(), 0, precision=FLOAT32, device=gpu)
        there.load_state_dict(state)
        assert torch.equal(there.score(3, **rollout(3)).reward, wanted)
        there.train(3)
    here.train(3)
    assert here.version == there.version == 4
