"""The whole loop on the point shard: its record, its ends, and exact resume."""

from dataclasses import dataclass
from pathlib import Path

import pytest
import torch

from actors.local import LocalFleet
from learner.config import LearnerConfig, LoopConfig
from learner.errors import TrainingError
from learner.loop import Loop, require_finite
from learner.ppo import Learner
from policy.checkpoints.format import read
from policy.checkpoints.run_checkpoints import RunCheckpoints, resolve
from tests.support.learning.loops import LAYOUT, Memory, Slowness, tensors
from tests.support.point_shard import ACTION, GOAL, STATE, PointShard
from world.precision import FLOAT32


@dataclass
class Running:
    loop: Loop
    memory: Memory
    fleet: LocalFleet

    def close(self) -> None:
        self.loop.close()
        self.fleet.close()


def start(
    path: Path, iterations: int, workers: int = 2, every: int = 100, style: bool = True, **shard
) -> Running:
    learner = Learner(
        STATE + GOAL,
        ACTION,
        LearnerConfig(
            hidden=(16, 16), warmup_iterations=2, minibatch=128, sigma=((0.0, 0.3), (3000.0, 0.1))
        ),
        seed=1,
        precision=FLOAT32,
    )
    fleet = LocalFleet(lambda owned: PointShard(owned, 5, **shard), 32, 8, workers, 5, horizon=8)
    memory = Memory()
    loop = Loop(
        learner,
        fleet,
        Slowness() if style else None,
        memory,
        RunCheckpoints(path, LAYOUT),
        LoopConfig(iterations=iterations, checkpoint_iterations=every),
        ("reach", "error"),
        ("near", "far"),
    )
    return Running(loop, memory, fleet)


def run(path: Path, iterations: int, resume: bool = False, **options) -> Running:
    running = start(path, iterations, **options)
    if resume:
        running.loop.load_state_dict(read(resolve(path), layout=LAYOUT).state)
    running.loop.run()
    running.close()
    return running


def test_a_checkpoint_without_a_finished_episode_is_not_the_best(tmp_path: Path) -> None:
    """Stopped soon after a stage began: nothing is known of it, and the best one is served."""
    running = start(tmp_path, 1)
    try:
        loop = running.loop
        for _ in range(2):
            loop.iterate()
        loop._checkpoint({"episode/success": 0.5})  # pyright: ignore[reportPrivateUsage]
        best = (tmp_path / "best").resolve()
        loop.iterate()
        loop._checkpoint({})  # pyright: ignore[reportPrivateUsage]
        assert (tmp_path / "best").resolve() == best != (tmp_path / "latest").resolve()
        loop.iterate()
        loop._checkpoint({"episode/success": 0.6})  # pyright: ignore[reportPrivateUsage]
        assert (tmp_path / "best").resolve() == (tmp_path / "latest").resolve()
    finally:
        running.close()


def test_resumed_equals_uninterrupted_bit_for_bit(tmp_path):
    whole = run(tmp_path / "whole", 12)
    first = run(tmp_path / "parts", 6)
    second = run(tmp_path / "parts", 12, resume=True)
    assert first.memory.numbers() + second.memory.numbers() == whole.memory.numbers()
    one = tensors(read(resolve(tmp_path / "whole")).state)
    other = tensors(read(resolve(tmp_path / "parts")).state)
    assert one.keys() == other.keys()
    for key in one.keys() - {"training/seconds", "training/best_score"}:
        if isinstance(one[key], torch.Tensor):
            assert torch.equal(one[key], other[key]), key
        else:
            assert one[key] == other[key], key


def test_same_numbers_for_any_number_of_workers(tmp_path):
    one, four = (run(tmp_path / str(w), 5, workers=w) for w in (1, 4))
    assert one.memory.numbers() == four.memory.numbers()


def test_record_holds_the_contracts_names(tmp_path):
    running = run(tmp_path, 8)
    assert [i for i, _ in running.memory.lines] == list(range(1, 9))
    last = running.memory.lines[-1][1]
    names = """samples seconds rate/samples_per_s rate/world_s rate/policy_s rate/style_s
        rate/update_s episode/return episode/length episode/success episode/fall
        episode/success_near episode/success_far reward/task reward/style reward/reach reward/error
        ppo/kl ppo/clip_fraction ppo/value_explained ppo/learning_rate ppo/sigma ppo/skipped
        ppo/bound lag/policy lag/style actors/alive dropped/samples style/seen"""
    assert set(names.split()) <= set(last)
    assert last["samples"] == 8 * 8 * 32
    assert last["lag/style"] == last["lag/policy"] == 0.0
    assert last["reward/reach"] == pytest.approx(last["reward/task"], rel=1e-5)
    # sigma of iteration 8 was set by the samples before it: 1792 of 3000
    assert last["ppo/sigma"] == pytest.approx(0.3 - 0.2 * 1792 / 3000)


def test_dropped_samples_are_counted(tmp_path):
    running = run(tmp_path, 2, broken=(4, 11))
    assert [m["dropped/samples"] for _, m in running.memory.lines] == [1.0, 0.0]


def test_runs_without_a_style(tmp_path):
    last = run(tmp_path, 2, style=False).memory.lines[-1][1]
    assert "reward/style" not in last


def next_stage(before, after, number):
    """Run the stage that follows `number` in `after`, from the state of `before`."""
    state = {**before.loop.state_dict()}
    state["training"] = {**state["training"], "stage": {"number": number, "unmet": ""}}
    after.loop.begin_stage(state, "met")
    after.loop.run()
    after.close()


def test_a_discriminator_outlasts_a_stage_without_a_style_reward(tmp_path):
    first = run(tmp_path / "first", 3)
    trained = first.loop.state_dict()["style"]
    assert trained["version"] == 3
    second = start(tmp_path / "second", 5, style=False)
    next_stage(first, second, 1)
    resumed = start(tmp_path / "second", 5, style=False)
    resumed.loop.load_state_dict(read(resolve(tmp_path / "second"), layout=LAYOUT).state)
    for plain in (second, resumed):
        assert plain.loop.state_dict()["style"] == trained
    third = start(tmp_path / "third", 7)
    next_stage(resumed, third, 2)
    resumed.close()
    assert third.loop.style is not None and third.loop.style.state_dict()["version"] == 5
    assert [line["lag/style"] for _, line in third.memory.lines] == [0.0, 0.0]


def test_a_discriminator_begins_in_the_first_stage_with_a_style_reward(tmp_path):
    first = run(tmp_path / "first", 3, style=False)
    second = start(tmp_path / "second", 5)
    next_stage(first, second, 1)
    assert second.loop.style is not None and second.loop.style.state_dict()["version"] == 2
    assert [line["lag/style"] for _, line in second.memory.lines] == [0.0, 0.0]


def test_a_requested_stop_writes_a_checkpoint(tmp_path):
    running = start(tmp_path, 100)
    running.loop.run(stop=lambda: len(running.memory.lines) == 3)
    running.close()
    assert resolve(tmp_path).name == "000003"


def test_checkpoints_come_on_time_and_at_the_end(tmp_path):
    run(tmp_path, 7, every=3)
    assert sorted(p.name for p in tmp_path.glob("0*")) == ["000003", "000006", "000007"]


def test_numbers_that_are_no_numbers_end_the_run_and_keep_the_checkpoint(tmp_path):
    running = start(tmp_path, 10, every=2)
    memory = running.memory

    class Poison(Memory):
        def record(self, iteration, metrics) -> None:
            memory.record(iteration, metrics)
            if iteration == 3:
                with torch.no_grad():
                    running.loop.learner.critic.head.bias.fill_(float("nan"))

    running.loop.recorder = Poison()
    with pytest.raises(TrainingError, match=r"iteration 4: .*ppo/value_explained.*not finite"):
        running.loop.run()
    running.close()
    assert resolve(tmp_path).name == "000002"
    assert len(memory.lines) == 3


def test_error_names_every_broken_metric():
    with pytest.raises(TrainingError, match="iteration 9: a/x, b/y not finite"):
        require_finite(9, {"a/x": float("nan"), "c/z": 1.0, "b/y": float("inf")})
    require_finite(9, {"c/z": 1.0})
