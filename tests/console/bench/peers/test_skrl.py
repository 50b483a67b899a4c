"""Settings of skrl: our batch and epochs."""

from console.bench.peers.protocol import Assignment
from console.bench.peers.skrl import settings
from console.run.experiment import PRESETS


def test_settings_are_ours() -> None:
    found = settings(Assignment(PRESETS["fast"], 2))
    assert (found["rollouts"], found["learning_epochs"], found["mini_batches"]) == (8, 3, 2)
    assert (found["discount_factor"], found["gae_lambda"]) == (0.985, 0.95)
    assert found["time_limit_bootstrap"], "a time-out is bootstrapped, as by ours"
