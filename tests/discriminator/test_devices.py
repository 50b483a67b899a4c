"""The discriminator on another device: the same rewards and the same state."""

from dataclasses import replace

import pytest
import torch

from discriminator import trainer
from discriminator.trainer import Discriminator
from policy.checkpoints.format import flatten
from tests.support.learning.recordings import LoggedGraph, counted_reads
from tests.support.stand_in_gpu import There, stand_in_gpu
from tests.support.style_cases import (
    SMALL,
    Mocap,
    assert_equal_states,
    discriminator,
    iterate,
    rollout,
)
from world.graphs import EAGER_CALLS, Replayed
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


def test_a_recorded_training_is_the_same_to_the_bit_also_after_a_resume(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Discriminator(SMALL, Mocap(), 0, precision=FLOAT32)
    with monkeypatch.context() as patch:
        patch.setattr(trainer, "replayed", lambda function, *_: Replayed(function, LoggedGraph))
        there = Discriminator(SMALL, Mocap(), 0, precision=FLOAT32)
    for first in (0, 5):
        last = first + 5
        wanted, found = iterate(here, first, last), iterate(there, first, last)
        assert all(torch.equal(a, b) for a, b in zip(wanted, found, strict=True))
        assert_equal_states(here.state_dict(), there.state_dict())
        assert there._gradient_step.recordings == 1
        there.load_state_dict(there.state_dict())
        assert there._gradient_step.recordings == 0
    assert 5 * SMALL.steps_per_iteration > EAGER_CALLS + 1


def test_the_number_of_reads_does_not_grow_with_the_gradient_steps() -> None:
    counts = []
    for steps in (1, 5):
        style = Discriminator(replace(SMALL, steps_per_iteration=steps), Mocap(), 0)
        style.score(0, **rollout(0))
        with counted_reads() as found:
            style.train(0)
        counts.append(len(found))
    assert counts[0] == counts[1] > 0
