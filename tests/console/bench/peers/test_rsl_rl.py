"""Settings of rsl_rl: our network, batch and epochs."""

from console.bench.peers.protocol import Assignment
from console.bench.peers.rsl_rl import settings
from console.run.experiment import PRESETS


def test_settings_are_ours() -> None:
    found = settings(Assignment(PRESETS["fast"], 2))
    assert found["actor"]["hidden_dims"] == found["critic"]["hidden_dims"] == [512, 256]
    assert found["actor"]["distribution_cfg"]["init_std"] == 0.05
    assert found["num_steps_per_env"] == 8
    algorithm = found["algorithm"]
    assert (algorithm["num_learning_epochs"], algorithm["num_mini_batches"]) == (3, 2)
    assert (algorithm["gamma"], algorithm["lam"]) == (0.985, 0.95)
