"""The end of a stage: by measured success over a window of its own, or at its limit."""

import pytest

from learner.stages import StageEnd

END = StageEnd(2, {"near": 0.4, "far": 0.3}, episodes=100, at_least=500, limit=2000)


@pytest.mark.parametrize(
    ("samples", "ended", "near", "far", "outcome"),
    [
        (499, 100, 1.0, 1.0, ""),  # not looked at yet
        (500, 99, 1.0, 1.0, ""),  # too few episodes
        (500, 100, 0.4, 0.3, "met"),
        (500, 100, 0.39, 1.0, ""),
        (1999, 100, 0.4, 0.29, ""),
        (2000, 100, 0.4, 0.29, "limit"),
        (2000, 100, 0.4, 0.3, "met"),  # a condition that holds at the limit is met
        (2000, 0, 1.0, 1.0, "limit"),
    ],
)
def test_a_stage_ends_by_its_condition_or_at_its_limit(
    samples: int, ended: int, near: float, far: float, outcome: str
) -> None:
    metrics = {"episode/success_near": near, "episode/success_far": far, "episode/success": 0.0}
    assert END.outcome(samples, ended, metrics) == outcome


def test_a_category_without_an_ended_episode_counts_as_no_success() -> None:
    assert END.measured({"episode/success_near": 0.9}) == {"near": 0.9, "far": 0.0}
    every = StageEnd(1, {"all": 0.5}, episodes=1, limit=10)
    assert every.measured({"episode/success": 0.7}) == {"all": 0.7}
    assert every.outcome(1, 1, {"episode/success": 0.7}) == "met"
