"""Metrics by name: a pattern stands for one per term, stage or kind of initial state."""

from console.run.metric_names import METRICS


def matching(name: str) -> list[str]:
    return [metric.name for metric in METRICS if metric.matches(name)]


def test_written_names_are_found() -> None:
    assert matching("ppo/kl") == ["ppo/kl"]
    assert "reward/TERM" in matching("reward/approach")
    assert matching("episode/stage_seated") == ["episode/stage_STAGE"]
    assert matching("episode/fall_near") == ["episode/fall_START"]
    assert matching("ppo/kl2") == [] and matching("reward/") == []


def test_every_metric_is_told_once() -> None:
    assert len({metric.name for metric in METRICS}) == len(METRICS)
    assert all(metric.meaning and metric.when for metric in METRICS)
