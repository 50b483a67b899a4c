"""The plots' data: which lines there are, and which frames are drawn."""

import numpy as np
import pytest

from console.play.browser import plots
from console.play.source import Curves


def test_there_are_plots_of_what_was_measured() -> None:
    assert plots.series_of(Curves(), {}) == {}
    curves = Curves(
        terms={"sit": np.array([0.0, 1.0]), "other": np.zeros(2)},
        error_m=np.array([0.5, 0.1]),
        success_m=0.2,
        fell=np.array([False, True]),
    )
    found = plots.series_of(curves, {"sit": 0.25})
    assert list(found) == ["reward terms (weight)", "distance from the goal, m", "success"]
    assert list(found["reward terms (weight)"]) == ["sit (0.25)", "other"]
    assert found["distance from the goal, m"]["success below"].tolist() == [0.2, 0.2]
    assert found["success"]["fallen"].tolist() == [0.0, 1.0]


def test_the_last_twenty_seconds_are_drawn() -> None:
    assert plots.window(0) == slice(0, 1)
    assert plots.window(599) == slice(0, 600) and plots.window(700) == slice(101, 701)


def test_frames_that_are_no_numbers_are_left_out() -> None:
    lines = {"a": np.array([np.nan, 1.0, 2.0, 3.0]), "b": np.array([0.0, 1.0, np.nan, 3.0])}
    seconds, a, b = plots.points(lines, slice(0, 4))
    assert seconds.tolist() == pytest.approx([1 / 30, 3 / 30])
    assert a.tolist() == b.tolist() == [1.0, 3.0]


def test_sources_of_one_kind_share_their_plots() -> None:
    def kind(name: str, weight: float, missing: str = "") -> tuple:
        curves = Curves(terms={name: np.zeros(2)}, missing=missing)
        return plots.kind_of(curves, {name: weight})

    assert kind("sit", 0.5) == kind("sit", 0.5)
    assert len({kind("sit", 0.5), kind("sit", 0.25), kind("lie", 0.5), kind("sit", 0.5, "no")}) == 4
