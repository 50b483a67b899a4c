"""Curves by hand: means of a window, marks, figures over seeds."""

import json
from dataclasses import replace

import pytest

from console.bench.peers.curves import Run, Window, ends, figures_of, marks

WINDOW = Window(1000, 1000, 250.0, 4, 90.0, 3, 2.0)


def run(seed: int, returns: list[float]) -> Run:
    """Ten windows of 100 samples, of four episodes each."""
    windows = [
        replace(WINDOW, samples=100 * (k + 1), returns=4 * value) for k, value in enumerate(returns)
    ]
    return Run("skrl", seed, "2.1.1", tuple(windows))


def test_means_of_a_window() -> None:
    assert (WINDOW.mean_return, WINDOW.reward_per_step, WINDOW.falls_ratio) == (22.5, 0.25, 0.75)
    empty = Window(0, 0, 0.0, 0, 0.0, 0, 0.0)
    assert (empty.mean_return, empty.reward_per_step, empty.falls_ratio) == (None, None, None)


def test_marks_are_ends_of_windows() -> None:
    assert marks(10_000_000) == (2_000_000, 5_000_000, 10_000_000)
    found = ends(10_000_000, 4096)
    assert len(found) == 40 and found[0] == 250_000
    for samples in (10_000_000, 163_840, 163_839, 50_000, 40_963):
        assert set(marks(samples)) <= set(ends(samples, 4096))


@pytest.mark.parametrize(
    ("samples", "windows"), [(163_840, 40), (163_839, 20), (81_919, 10), (40_960, 10), (40_959, 0)]
)
def test_a_window_holds_an_iteration(samples: int, windows: int) -> None:
    assert len(ends(samples, 4096)) == windows


def test_figures_are_means_over_seeds_with_the_least_and_greatest() -> None:
    rising = run(0, [float(k) for k in range(10)])
    flat = run(1, [2.0] * 10)
    found = figures_of([rising, flat], 1000)
    # at 200 samples the second window: 1 and 2; at 500 the fifth: 4 and 2; at 1000: 9 and 2
    assert found["skrl_at_200_return"] == 1.5
    assert (found["skrl_at_500_return_least"], found["skrl_at_500_return"]) == (2.0, 3.0)
    assert (found["skrl_at_1000_return"], found["skrl_at_1000_return_greatest"]) == (5.5, 9.0)
    assert found["skrl_at_200_reward_per_step"] == 0.25
    assert found["skrl_at_200_falls_ratio"] == 0.75
    assert len(found) == 3 * 3 * 3


def test_a_figure_that_a_seed_lacks_is_left_out() -> None:
    short = Run("skrl", 1, "2.1.1", run(1, [2.0] * 10).windows[:4])
    found = figures_of([run(0, [1.0] * 10), short], 1000)
    assert "skrl_at_200_return" in found and "skrl_at_500_return" not in found


def test_the_window_at_a_mark_is_the_first_that_reaches_it() -> None:
    """A library trains in whole iterations: its windows end a little after the mark."""
    late = Run("rllib", 0, "2.60.0", (replace(WINDOW, samples=196), replace(WINDOW, samples=230)))
    found = late.at(200)
    assert found is not None and found.samples == 230
    assert late.at(231) is None


def test_rates_leave_out_the_first_window() -> None:
    """It holds the building of the scenes."""
    windows = (replace(WINDOW, seconds=60.0), replace(WINDOW, samples=3000, seconds=4.0))
    assert Run("skrl", 0, "2.1.1", windows).rate == 500.0


def test_a_run_is_the_same_after_json() -> None:
    one = run(3, [1.0, 2.0])
    assert Run.from_json(json.loads(json.dumps(one.to_json()))) == one
    with pytest.raises(KeyError):
        Run.from_json({"name": "skrl"})
