"""Trial outcomes and intervals against numbers worked by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from console.evaluation.scores import Protocol, judge, summarise, wilson

TINY = Protocol(success_m=0.2, limit_s=1.0, hold_s=0.2, control_hz=10)
"""10 steps to succeed, 2 to hold, 12 in all."""


def errors(*near: int) -> np.ndarray:
    """One trial's errors: 0.1 m at the given steps, 1 m elsewhere."""
    row = np.ones(12, np.float32)
    row[list(near)] = 0.1
    return row


def outcome(row: np.ndarray, fell_at: int = 12):
    return judge(row[None], np.array([fell_at]), TINY)


def test_touching_the_seat_is_success_but_not_sustained():
    got = outcome(errors(4))
    assert got.success[0] and not got.sustained[0]
    assert got.time_s[0] == pytest.approx(0.5)  # after the fifth step of 0.1 s
    assert got.precision_m[0] == pytest.approx(0.1)


def test_holding_two_steps_is_sustained_unless_a_fall_follows():
    assert outcome(errors(4, 5)).sustained[0]
    fallen = outcome(errors(4, 5), fell_at=8)
    assert fallen.success[0] and not fallen.sustained[0] and fallen.fell[0]


def test_nothing_counts_after_a_fall():
    got = outcome(errors(6, 7), fell_at=5)
    assert not got.success[0] and math.isnan(got.time_s[0]) and math.isnan(got.precision_m[0])


def test_success_after_the_limit_does_not_count_but_a_hold_may_end_there():
    assert not outcome(errors(10, 11)).success[0]
    last = outcome(errors(9, 10))
    assert last.success[0] and last.sustained[0]


def test_a_fall_after_the_limit_is_none_of_the_trial_but_breaks_the_hold():
    got = outcome(errors(9, 10), fell_at=11)
    assert got.success[0] and not got.fell[0] and not got.sustained[0]


def test_wilson_against_published_values():
    # Newcombe 1998, table I: 81 of 263 -> 0.2553 to 0.3662; 0 of 20 -> 0 to 0.1611.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert wilson(0, 0) == (0.0, 1.0)


@given(st.integers(1, 5000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_contains_the_rate(pair):
    hits, n = pair
    low, high = wilson(hits, n)
    assert 0 <= low <= hits / n + 1e-12 and hits / n - 1e-12 <= high <= 1


def test_summary_by_object_and_distance():
    rows = np.stack([errors(4, 5), errors(), errors(2)])
    got = judge(rows, np.array([12, 3, 12]), TINY)
    figures = summarise(got, ["a", "a", "b"], np.array([1.5, 5.0, 9.0]))
    assert figures["success"]["rate"] == pytest.approx(2 / 3)
    assert figures["sustained"]["rate"] == pytest.approx(1 / 3)
    assert figures["falls"] == pytest.approx(1 / 3)
    assert figures["time_s"] == pytest.approx((0.5 + 0.3) / 2)
    assert figures["by_object"] == [
        {"object": "a", "trials": 2, "success": 0.5},
        {"object": "b", "trials": 1, "success": 1.0},
    ]
    assert [d["success"] for d in figures["by_distance"]] == [1.0, 0.0, 1.0]
