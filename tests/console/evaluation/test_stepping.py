"""Disturbed trials are the same by any number of threads."""

import numpy as np
import pytest
import torch

from console.evaluation import trials
from console.evaluation.command import manifest_of
from console.evaluation.scores import Protocol
from tests.support.console.trials import command, standing
from world.config import WorldConfig
from world.furniture.catalogue import catalogue

WORLD = WorldConfig()


@pytest.mark.parametrize("kind", ["projectiles", "moved"])
def test_disturbed_trials_do_not_depend_on_threads_or_number(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trials, "CHUNK", 16)
    pieces, protocol = catalogue("test"), Protocol(limit_s=2.0, hold_s=0.2)
    many = manifest_of("sit", pieces, command(trials=40, perturb=kind), protocol, (0.8, 1.2))
    few = manifest_of("sit", pieces, command(trials=20, perturb=kind), protocol, (0.8, 1.2))
    assert np.array_equal(many.distance_m[:20], few.distance_m)
    assert torch.equal(many.disturbance.step[:20], few.disturbance.step)
    assert torch.equal(many.disturbance.draw[:20], few.disturbance.draw)
    one = trials.drive(WORLD, standing, many, 24, 1)
    two = trials.drive(WORLD, standing, many, 24, 2)
    assert np.array_equal(one.error_m, two.error_m)
    assert np.array_equal(one.disturbed, two.disturbed)
