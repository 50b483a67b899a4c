"""Charts: ticks, points, thinned lines."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from console.report import charts
from console.report.charts import Line


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_ticks_enclose_and_are_round(low: float, span: float) -> None:
    high = low + span
    found = charts.ticks(low, high)
    assert 2 <= len(found) <= 8
    slack = 1e-6 * (abs(low) + abs(high))
    assert found[0] <= low + slack and found[-1] >= high - slack


def test_ticks_and_labels_by_hand() -> None:
    assert charts.ticks(0.0, 1.0) == [0.0, 0.5, 1.0]
    assert charts.ticks(-0.3, 7.2) == [-2.0, 0.0, 2.0, 4.0, 6.0, 8.0]
    assert charts.decades(0.03, 4.0) == pytest.approx([0.01, 0.1, 1.0, 10.0])
    assert [charts.shown(x) for x in (0, 0.25, 1500, 2e6, 5e-5)] == [
        "0", "0.25", "1500", "2e6", "5e-5",
    ]  # fmt: skip


def test_a_chart_puts_points_where_they_belong() -> None:
    drawn = charts.chart("t & u", [Line("a", ((0.0, 0.0), (1.0, 1.0), (2.0, 0.5)))], "x")
    points = re.search(r'points="([^"]+)"', drawn)
    assert points is not None and "t &amp; u" in drawn
    xy = [tuple(map(float, p.split(","))) for p in points[1].split()]
    assert [x for x, _ in xy] == pytest.approx([46.0, 198.0, 350.0])
    assert [y for _, y in xy] == pytest.approx([180.0, 36.0, 108.0])
    assert charts.chart("none", [Line("a", ((0.0, 1.0),))], "x") == ""
    assert charts.chart("bad", [Line("a", ((0.0, -1.0), (1.0, 0.0)))], "x", True) == ""


def test_thinning_keeps_the_mean() -> None:
    points = tuple((float(i), float(i % 7)) for i in range(1001))
    thin = charts.thinned(points, 100)
    assert len(thin) == 100
    assert np.mean([y for _, y in thin]) == pytest.approx(np.mean([y for _, y in points]), abs=0.02)
    assert charts.thinned(((0.0, float("nan")), (1.0, 2.0))) == ((1.0, 2.0),)
