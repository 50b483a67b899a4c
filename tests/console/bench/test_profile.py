"""The profile: each part's own time, none lost or counted twice."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from console.bench import profile
from console.run import assembly
from console.run.experiment import PRESETS
from policy.checkpoints.format import Manifest, write
from tests.support import small_clips
from world.config import WorldConfig


class _Clock:
    """A clock that the timed methods move."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_a_part_has_its_own_time_alone() -> None:
    clock = _Clock()

    class Inner:
        def work(self) -> str:
            clock.now += 3.0
            return "done"

    class Outer:
        def work(self) -> str:
            clock.now += 1.0
            found = Inner().work()
            Inner().work()
            clock.now += 0.5
            return found

    watch, before = profile.Stopwatch(clock), Outer.work
    with watch.watching((("outer", Outer, "work"), ("inner", Inner, "work"))):
        assert Outer().work() == "done"
        Inner().work()
        assert watch.seconds == {"outer": 1.5, "inner": 9.0}
        watch.reset()
        assert not watch.seconds
    assert Outer.work is before
    Outer().work()
    assert not watch.seconds


def test_a_raised_error_leaves_the_times_whole() -> None:
    clock = _Clock()

    class Failing:
        def work(self) -> None:
            clock.now += 2.0
            raise ValueError("fell")

    watch = profile.Stopwatch(clock)
    with watch.watching((("part", Failing, "work"),)), pytest.raises(ValueError, match="fell"):
        Failing().work()
    assert watch.seconds == {"part": 2.0}


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkpoint of a policy that knows nothing, with a small experiment."""
    folder = tmp_path_factory.mktemp("profiled")
    clips = (str(small_clips.write(folder)),)
    fast = PRESETS["fast"]
    experiment = replace(
        fast,
        scenes=16,
        block=8,
        horizon=2,
        world=WorldConfig(motions=clips, mirror=False, pieces=2, scales=1),
        ppo=replace(fast.ppo, hidden=(16, 16), minibatch=16),
    )
    student = assembly.learner(experiment)
    state = student.policy_state()
    student.close()
    manifest = Manifest(assembly.layout(experiment), 0, 0, assembly.notes(experiment))
    write(folder / "checkpoint", {"policy": state}, manifest)
    return folder / "checkpoint"


def test_the_parts_add_up_to_an_iteration(source: Path) -> None:
    found = profile.measure(source, 0.0, 2)
    names = dict.fromkeys(name for name, _, _ in profile.PARTS)
    parts = [found[f"{name}_processor_us_per_sample"] for name in (*names, "other")]
    assert sum(parts) == pytest.approx(found["processor_us_per_sample"])
    spent = dict(zip(names, parts, strict=False))
    # so few steps may end no episode
    assert all(part > 0.0 for name, part in spent.items() if name != "resets")
    assert found["samples_per_core_s"] == pytest.approx(1e6 / found["processor_us_per_sample"])
    assert sum(found[f"{name}_of_iteration_ratio"] for name in (*names, "other")) == pytest.approx(
        1.0
    )
    shares = [found[f"{name}_of_physics_ratio"] for name in (*profile.PHYSICS, "rest")]
    assert sum(shares) == pytest.approx(1.0) and min(shares) >= 0.0


def test_substeps_are_those_of_the_state(source: Path) -> None:
    """Characters that float have no contacts; the solver then takes no iteration."""
    experiment = assembly.trained(source).experiment
    state = assembly.shard(experiment.world, range(8), 0).state_dict()
    state["physics_qpos"][:, 2] += 5.0
    found = profile.physics(experiment, state)
    assert found["contacts_per_substep"] == 0.0 == found["constraint_rows_per_substep"]
    assert torch.isfinite(torch.tensor(list(found.values()))).all()
