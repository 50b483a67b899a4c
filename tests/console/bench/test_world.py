"""The world's bench: the shard's step is the raw one and what is around it."""

from dataclasses import replace
from pathlib import Path

import pytest

from console.bench import world
from console.run.experiment import PRESETS
from tests.support import small_clips
from world.config import WorldConfig


def test_the_ratio_is_that_of_the_rates(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(world, "MEMORY_SCENES", 4)
    clips = (str(small_clips.write(tmp_path)),)
    scenes = WorldConfig(motions=clips, mirror=False, pieces=2, scales=1)
    found = world.measure(replace(PRESETS["fast"], scenes=4, world=scenes), seconds=0.0)
    ratio = found["shard_control_steps_per_s"] / found["raw_control_steps_per_s"]
    assert found["shard_to_raw_ratio"] == pytest.approx(ratio) and ratio < 1.0
    assert found["shard_us_per_step"] == pytest.approx(1e6 / found["shard_control_steps_per_s"])
