"""Turns of a measurement, on a clock of the test's own."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from console.bench import turns as module
from console.bench.turns import turns


@pytest.fixture
def noted(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """What the progress is told, in percent."""
    found: list[float] = []

    @contextmanager
    def progress(unit: str, total: float) -> Iterator[Any]:
        assert total == 100.0 and unit
        yield found.append

    monkeypatch.setattr(module, "progress", progress)
    return found


def clock(step_s: float) -> Any:
    """A clock that goes on by step_s with every look at it."""
    times = iter(step_s * i for i in range(10_000))
    return lambda: next(times)


def test_both_the_time_and_the_turns_must_be_over(noted: list[float]) -> None:
    # a look at the clock is a second: one at the beginning, then one or two a turn
    assert list(turns(0.0, 3, clock=clock(1.0))) == [0, 1, 2]
    assert noted == pytest.approx([100 / 3, 200 / 3, 100])
    noted.clear()
    assert len(list(turns(10.0, 2, clock=clock(1.0)))) == 6
    assert noted[-1] == 100.0 and noted == sorted(noted) and noted[0] == pytest.approx(10.0)


def test_the_most_turns_end_it_before_the_time(noted: list[float]) -> None:
    assert list(turns(1e9, 1, most=4, clock=clock(1.0))) == [0, 1, 2, 3]
    assert noted == pytest.approx([25, 50, 75, 100])
