"""One update on another device: the same numbers, every tensor moved, one checkpoint for all."""

from dataclasses import replace

import pytest
import torch

from learner.cloning import clone
from learner.ppo import Learner
from policy.checkpoints.format import flatten
from policy.rollout import Rollout
from tests.learner.test_ppo import CONFIG, bold, collect, numbers
from tests.support.inline import Inline
from tests.support.point_shard import ACTION, GOAL, STATE
from tests.support.stand_in_gpu import There, stand_in_gpu
from world.device import DeviceError, resolve
from world.precision import FLOAT32

SMALL = replace(CONFIG, minibatch=320, epochs=2)


def learner() -> Learner:
    return Learner(STATE + GOAL, ACTION, SMALL, 3, FLOAT32)


def on(device: torch.device) -> Learner:
    made = Learner(STATE + GOAL, ACTION, SMALL, 3, FLOAT32, device=device)
    made._pool = Inline()  # the stand-in's modes belong to this thread
    return made


def rollout() -> Rollout:
    """With falls and time-outs."""
    got = collect(bold(learner()), horizon=40)
    assert got.fell.any() and got.timed_out.any()
    return got


def test_an_update_on_the_stand_in_is_the_cpus_to_the_bit() -> None:
    here, got = bold(learner()), rollout()
    with stand_in_gpu() as gpu:
        there = bold(on(gpu))
        assert isinstance(there.actor.layers[0].weight, There)
        for _ in range(2):
            wanted = numbers(here.update(got, got.rewards, 0.3))
            found = numbers(there.update(got, got.rewards, 0.3))
            assert found == wanted
        for name, tensor in there.weights().items():
            assert not isinstance(tensor, There), f"{name} is published from the GPU"
            assert torch.equal(tensor, here.weights()[name]), name


def test_a_checkpoint_is_the_same_on_every_device_and_goes_on_on_the_other() -> None:
    here, got = bold(learner()), rollout()
    with stand_in_gpu() as gpu:
        there = bold(on(gpu))
        for held in (here, there):
            held.update(got, got.rewards, 0.3)
        saved = {}
        for name, held in (("cpu", here), ("gpu", there)):
            tensors, values = flatten({"p": held.policy_state(), "t": held.state_dict()})
            assert not any(isinstance(tensor, There) for tensor in tensors.values())
            saved[name] = tensors, values
        assert saved["cpu"][1] == saved["gpu"][1]
        assert saved["cpu"][0].keys() == saved["gpu"][0].keys()
        for name, tensor in saved["cpu"][0].items():
            assert torch.equal(tensor, saved["gpu"][0][name]), name
        back = on(gpu)
        back.load_policy_state(here.policy_state())
        back.load_state_dict(here.state_dict())
        wanted = numbers(here.update(got, got.rewards, 0.3))
        assert numbers(back.update(got, got.rewards, 0.3)) == wanted


def test_cloning_on_the_stand_in() -> None:
    inputs, targets = torch.randn(300, STATE + GOAL), torch.randn(300, ACTION)
    here = learner()
    wanted = clone(here.actor, here.normaliser, inputs, targets, 2)
    with stand_in_gpu() as gpu:
        there = on(gpu)
        found = clone(there.actor, there.normaliser, inputs.to(gpu), targets.to(gpu), 2)
    assert found == wanted


def test_an_update_on_a_gpu_is_the_cpus_within_1e_4() -> None:
    try:
        gpu = resolve("cuda").torch
    except DeviceError as error:
        pytest.skip(str(error))
    torch.set_float32_matmul_precision("highest")
    here, got = bold(learner()), rollout()
    there = bold(Learner(STATE + GOAL, ACTION, SMALL, 3, FLOAT32, device=gpu))
    wanted = numbers(here.update(got, got.rewards, 0.3))
    found = numbers(there.update(got, got.rewards, 0.3))
    assert found == pytest.approx(wanted, abs=1e-4)
    for name, tensor in there.weights().items():
        assert torch.allclose(tensor, here.weights()[name], atol=1e-4), name
