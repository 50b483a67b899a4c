"""The servos' bench counts what it stepped, and nothing blows up."""

from dataclasses import replace

import pytest

from console.bench import servos
from console.run.experiment import PRESETS
from world.character import model as character


def test_it_stops_when_every_scene_has_had_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(servos, "SIMULATED_S", 0.5)
    found = servos.measure(replace(PRESETS["fast"], scenes=3), seconds=1e9, threads=1)
    assert found["simulated_s_per_scene"] == pytest.approx(0.5, abs=1 / character.CONTROL_HZ)
    assert found["blown_up_scenes"] == 0
    assert 1.0 < found["fastest_joint_median_rad_per_s"] <= found["fastest_joint_rad_per_s"] < 100.0
