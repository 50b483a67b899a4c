"""Recordings of functions: what they replay, what they must be told, and when there are none."""

import pytest
import torch
from torch import Tensor

from tests.support.learning.recordings import LoggedGraph, ReadError
from world.device import CPU
from world.graphs import EAGER_CALLS, MOST_SHAPES, Replayed, forget, replayed


class Held:
    """A weight that a function changes in place, and how often its Python ran."""

    def __init__(self) -> None:
        self.weight, self.calls = torch.tensor([1.0]), 0

    def step(self, x: Tensor, y: Tensor | None) -> Tensor:
        self.calls += 1
        self.weight.add_(x.sum() if y is None else x.sum() * y.sum())
        return self.weight * 2.0


def test_on_the_cpu_a_function_is_itself() -> None:
    held = Held()
    step = held.step
    assert replayed(step, CPU) is step
    forget(step)


def test_a_replay_runs_the_kernels_and_not_the_python() -> None:
    held = Held()
    replay = Replayed(held.step, LoggedGraph)
    results = [replay(torch.tensor([float(k)]), None) for k in range(EAGER_CALLS + 4)]
    total = 1.0
    for k, result in enumerate(results):
        total += k
        assert result.item() == 2.0 * total, "each result has memory of its own"
    assert held.calls == EAGER_CALLS + 1 and replay.recordings == 1


def test_each_set_of_shapes_has_its_recording_up_to_a_bound() -> None:
    held = Held()
    replay = Replayed(held.step, LoggedGraph)
    total = 1.0
    for _ in range(EAGER_CALLS + 2):
        for size in range(1, MOST_SHAPES + 3):
            for y in (None, torch.tensor([2.0])):
                total += size if y is None else 2.0 * size
                assert replay(torch.ones(size), y).item() == pytest.approx(2.0 * total)
    assert replay.recordings == MOST_SHAPES


def test_a_tensor_that_is_another_one_needs_forget() -> None:
    held = Held()
    replay = Replayed(held.step, LoggedGraph)
    for _ in range(EAGER_CALLS + 1):
        replay(torch.ones(1), None)
    held.weight = torch.tensor([100.0])
    assert replay(torch.ones(1), None).item() == 2.0 * (EAGER_CALLS + 3), "the old memory"
    forget(replay)
    assert replay(torch.ones(1), None).item() == 202.0
    assert replay.recordings == 0


def test_what_cannot_be_recorded_runs_as_it_is_and_says_so(
    caplog: pytest.LogCaptureFixture,
) -> None:
    def read(x: Tensor) -> Tensor:
        return x * float(x.sum())

    replay = Replayed(read, LoggedGraph)
    for k in range(EAGER_CALLS + 3):
        assert replay(torch.tensor([float(k)])).item() == float(k * k)
    assert replay.recordings == 0
    assert [r.getMessage().partition(":")[0] for r in caplog.records] == [
        "kernels cannot be recorded, so each is started by itself"
    ]
    with pytest.raises(ReadError):
        LoggedGraph().record(lambda: read(torch.ones(1)))
