"""Moments of a stepped scene: the limit at which it stops, or forgets."""

import pytest

from console.play import frames
from console.play.frames import Frames
from console.play.player import Player
from tests.support.console import players


def test_a_scene_stops_at_the_limit_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frames, "LIMIT", 5)
    source = players.live()
    assert [source.extend() for _ in range(6)] == [True] * 4 + [False] * 2
    assert len(source) == 5 and "start again" in source.ended


def test_a_rolling_one_forgets_a_tenth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frames, "LIMIT", 20)
    source = Frames(players.live().scene, rolling=True)
    player = Player(source)
    seen = []
    for _ in range(25):
        assert player.advance(1 / 30) == 1
        seen.append(len(source))
    assert seen[:19] == list(range(2, 21)) and seen[19:] == [19, 20, 19, 20, 19, 20]
    assert player.frame == player.last and not source.ended
    source.cut(3)
    assert len(source) == 4 and source.extend()
