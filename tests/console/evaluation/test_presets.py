"""Presets are the published protocols."""

import pytest

from console.evaluation.command import distances
from console.evaluation.presets import published
from tests.support.console.trials import command
from world.errors import ChoiceError
from world.scene import perturbations


def test_presets_and_published_rows() -> None:
    assert distances(command(), "sit") == (1.0, 10.0)
    assert distances(command(preset="table3"), "sit") == (1.0, 5.0)
    assert distances(command(preset="table3", far_m=2.0), "sit") == (1.0, 2.0)
    assert [row.success for row in published("lie", "table1", "none")] == [90.2]
    assert [row.success for row in published("lie", "table1", "moved")] == [82.0]
    assert published("sit", "table3", "none")[0].time_s == 3.7
    assert published("juggle", "table1", "none") == ()
    with pytest.raises(ChoiceError, match="moved, none, projectiles"):
        perturbations.draw("rain", 1, 0, 100)
