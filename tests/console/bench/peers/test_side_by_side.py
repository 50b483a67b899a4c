"""The flags of `bench peers` and `bench learning` at their measurements."""

from pathlib import Path
from typing import Any

import pytest

from console.bench.peers import alternation, learning, side_by_side
from console.commands import Bench
from console.run.experiment import PRESETS

EXPERIMENT = PRESETS["fast"]


def test_flags_of_peers(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Any] = []
    monkeypatch.setattr(alternation, "measure", lambda *a, **k: given.append((a, k)))
    command = Bench("peers", seconds=3.0, rounds=4, peer_python=("skrl=x",), fleet_actors=(2,))
    side_by_side.peers(command, EXPERIMENT, 2)
    assert given == [((EXPERIMENT, 2, 3.0, 4, ("skrl=x",)), {"actors": (2,)})]


def test_flags_of_learning(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Any] = []
    monkeypatch.setattr(learning, "measure", lambda *a: given.append(a))
    file = Path("curves.json")
    command = Bench("learning", samples=70_000, seeds=2, only=("skrl",), peer_python=("skrl=x",),
                    json=file)  # fmt: skip
    side_by_side.learning(command, EXPERIMENT, 2, print)
    assert given == [(EXPERIMENT, 2, 70_000, 2, ("skrl",), ("skrl=x",), file, print)]
