"""One update on another device: the same numbers, every tensor moved, one checkpoint for all."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from learner import ppo
from learner.cloning import clone
from learner.config import LagConfig, LoopConfig
from learner.loop import Loop
from learner.ppo import Learner
from learner.segments import SEGMENT, WORLD
from policy.checkpoints.format import flatten, unflatten
from policy.checkpoints.run_checkpoints import RunCheckpoints
from policy.rollout import Rollout
from tests.support.inline import Inline
from tests.support.learning.learners import CONFIG, bold, collect, numbers, same
from tests.support.learning.loops import LAYOUT, LEARNING, Memory, Slowness, points
from tests.support.learning.recordings import LoggedGraph, counted_reads
from tests.support.point_shard import ACTION, GOAL, STATE
from tests.support.stand_in_gpu import There, stand_in_gpu
from world.device import CPU, DeviceError, put, resolve
from world.graphs import Replayed
from world.precision import FLOAT32
from world.reflection import Reflection, Symmetry

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


FULL = replace(
    SMALL,
    minibatch=100,  # 640 samples: minibatches of 106 and 107
    mirror_weight=0.5,
    imitation_weight=0.3,
    clip=((0.0, 0.3), (2000.0, 0.1)),
    kl_target=((0.0, 0.5), (1200.0, 1e-7)),
)
#: Any involution serves: what is compared is the same loss made in two ways.
SWAPPED = Symmetry(
    Reflection(torch.tensor([1, 0, 2, 3, 5, 4]), torch.ones(6)),
    Reflection(torch.tensor([1, 0]), torch.ones(2)),
)


def full() -> Learner:
    return bold(Learner(STATE + GOAL, ACTION, FULL, 3, FLOAT32, SWAPPED))


def labelled() -> Rollout:
    """With a teacher's labels in some samples, and one sample that is not valid."""
    got = collect(bold(learner()), horizon=40, broken=(4, 11))
    labels = torch.full_like(got.actions, float("nan"))
    labels[::3, :, 0] = 0.2
    return replace(got, teacher_action=labels)


def test_a_recorded_update_is_the_same_to_the_bit_whatever_changes_between_steps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Sigma, clip range, learning rate and its ramp, skipped steps, two sizes of minibatches, a
    resume: nothing of them may be a number of the recording."""
    here, got = full(), labelled()
    with monkeypatch.context() as patch:
        patch.setattr(ppo, "replayed", lambda function, *_: Replayed(function, LoggedGraph))
        there = full()
    seen = []
    for turn, sigma in enumerate((0.3, 0.3, 0.25, 0.2, 0.3)):
        if turn == 3:
            for held in (here, there):
                held.load_state_dict(held.state_dict())
                held.load_policy_state(held.policy_state())
            assert there._actor_step.recordings == 0
        wanted = numbers(here.update(got, got.rewards, sigma))
        assert numbers(there.update(got, got.rewards, sigma)) == wanted
        assert same(there.policy_state(), here.policy_state())
        seen.append(wanted)
    assert same(there.state_dict()["actor_optimiser"], here.state_dict()["actor_optimiser"])
    assert there._actor_step.recordings == there._critic_step.recordings == 2
    # some steps are taken and some are skipped, or the test shows little
    skipped = [metrics["ppo/skipped"] for metrics in seen]
    assert skipped[0] == 0.0 and skipped[-1] > 0.0
    assert len({metrics["ppo/learning_rate"] for metrics in seen}) > 1
    assert all(metrics["ppo/mirror"] and metrics["ppo/imitation"] for metrics in seen[:1])


def test_the_number_of_reads_does_not_grow_with_the_gradient_steps() -> None:
    """Each read would wait for a GPU until it has done all that is queued."""
    counts, got = [], labelled()
    for epochs, minibatch in ((1, 640), (2, 160)):
        config = replace(FULL, epochs=epochs, minibatch=minibatch)
        held = bold(Learner(STATE + GOAL, ACTION, config, 3, FLOAT32, SWAPPED))
        held._pool = Inline()
        with counted_reads() as found:
            held.update(got, got.rewards, 0.3)
        counts.append(len(found))
    assert counts[0] == counts[1] > 0


@pytest.mark.parametrize("overlap", [False, True])
def test_a_training_on_the_stand_in_is_the_cpus_and_resumes_on_either(
    overlap: bool, tmp_path: Path
) -> None:
    """Rollouts are moved where they are gathered, that one too that waits in a checkpoint; the
    rewards of a style that answers on the CPU meet those of the GPU."""
    config = LoopConfig(lag=LagConfig(overlap=overlap))

    class Service(Slowness):
        def score(self, batch, rollout_states, end_index, end_states, valid):
            tensors = (rollout_states, end_index, end_states, valid)
            return super().score(batch, *(tensor.cpu() for tensor in tensors))

    def loop(name: str, device: torch.device) -> Loop:
        held = Learner(STATE + GOAL, ACTION, LEARNING, 1, FLOAT32, device=device)
        held._pool.shutdown()
        checkpoints = RunCheckpoints(tmp_path / name, LAYOUT)
        made = Loop(held, points(), Service(), Memory(), checkpoints, config, ("reach", "error"))
        made._background = held._pool = Inline()
        made.gathering._pool = Inline() if overlap else None
        return made

    def lines(made: Loop, count: int) -> list[tuple[int, dict]]:
        for _ in range(count):
            made.recorder.record(made.learner.version, made.iterate())
        return made.recorder.numbers()[-count:]

    here = loop("here", CPU)
    wanted = lines(here, 3)
    with stand_in_gpu() as gpu:
        there = loop("there", gpu)
        assert lines(there, 3) == wanted
        assert isinstance(
            there.gathering.next(there.learner.weights(), 0, 0.3).rollout.states, There
        )
    state = unflatten(*flatten(here.state_dict()))
    following = lines(here, 2)
    with stand_in_gpu() as gpu:
        back = loop("back", gpu)
        back.load_state_dict(state)
        assert lines(back, 2) == following
    for made in (here, there, back):
        made.fleet.close()


class ScenesThere:
    """A fleet whose scenes are on a device, as those of mujoco-warp."""

    def __init__(self, device: torch.device) -> None:
        self.fleet, self.device = points(), device

    def collect(self, weights, version, sigma) -> Rollout:
        own = {k: v for k, v in weights.items() if not k.startswith(WORLD)}
        found = self.fleet.collect(own, version, sigma)
        number = torch.arange(len(found.end_index)) % 3
        told = {SEGMENT: number.float(), "piece_sit": number.float()}
        episodes = {k: put(v, self.device) for k, v in (found.episodes | told).items()}
        return replace(found.on(self.device), episodes=episodes)

    def __getattr__(self, name: str):
        return getattr(self.fleet, name)


def test_scenes_on_the_stand_in_are_counted_as_the_cpus(tmp_path: Path) -> None:
    """Statistics and failures of episodes that ended there."""
    found = []
    for name in ("here", "there"):
        with stand_in_gpu() if name == "there" else nullcontext(CPU) as device:
            held = Learner(STATE + GOAL, ACTION, LEARNING, 1, FLOAT32, device=device)
            held._pool.shutdown()
            held._pool = Inline()
            checkpoints = RunCheckpoints(tmp_path / name, LAYOUT)
            fleet = ScenesThere(device)
            config = LoopConfig(iterations=9)
            loop = Loop(held, fleet, None, Memory(), checkpoints, config, ("reach", "error"))
            loop.run()
            state = loop.state_dict()["training"]
            assert len(loop.episodes) > 0 and len(state["failures"]["counts"]) == 3
            found.append((loop.recorder.numbers(), state["episodes"], state["failures"]))
            loop.close()
            loop.fleet.close()
    assert found[0][0] == found[1][0]
    assert same(found[0][1], found[1][1]) and same(found[0][2], found[1][2])


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
