"""Our own loop as one of the processes."""

from dataclasses import replace
from pathlib import Path

import pytest

from console.bench.peers import counters
from console.bench.peers.ours import open_peer
from console.bench.peers.protocol import Assignment
from console.run.experiment import PRESETS, Experiment
from world.config import WorldConfig


def small(style_weight: float) -> Experiment:
    preset = PRESETS["fast"]
    return replace(
        preset,
        scenes=32,
        block=32,
        horizon=2,
        world=WorldConfig(pieces=4, scales=1),
        ppo=replace(preset.ppo, hidden=(16,), style_weight=style_weight, warmup_iterations=0),
        style=replace(preset.style, hidden=(16,), batch=32, replay=500, normaliser_samples=200),
    )


def test_scenes_are_counted_in_a_folder(tmp_path: Path) -> None:
    with open_peer(Assignment(small(0.0), 1, str(tmp_path))) as iterate:
        assert counters.read(tmp_path) == counters.Counts()
        iterate()
        once = counters.read(tmp_path)
        assert once.control_steps == 64 and once.reward > 0.0
        iterate()
        assert counters.read(tmp_path).control_steps == 128


@pytest.mark.parametrize("style_weight", [0.0, 0.4])
def test_an_iteration_is_a_whole_one(style_weight: float, monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[dict[str, float]] = []
    from learner.loop import Loop

    whole = Loop.iterate
    monkeypatch.setattr(Loop, "iterate", lambda self: found.append(whole(self)))
    with open_peer(Assignment(small(style_weight), 1)) as iterate:
        assert iterate() == 64
    assert found[0]["ppo/kl"] > 0.0, "the actor is updated"
    assert ("reward/style" in found[0]) == (style_weight > 0.0)
