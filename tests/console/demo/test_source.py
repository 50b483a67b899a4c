"""The room as a source: its status, its measures, and the moments that it forgets."""

import numpy as np
import pytest

from console.demo.source import RoomFrames
from console.play import frames
from console.play.page import page
from console.play.player import Player
from tests.support.console import rooms
from world.errors import ConfigError


def test_it_forgets_its_oldest_moments_and_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frames, "LIMIT", 20)
    source = RoomFrames(rooms.room())
    player = Player(source)
    lengths = []
    for _ in range(30):
        assert player.advance(1 / 30) == 1
        lengths.append(len(source))
        assert player.frame == player.last
    assert max(lengths) == 20 and lengths[-1] >= 18 and source.room.time_step == 30


def test_its_status_and_measures() -> None:
    room = rooms.room()
    source = RoomFrames(room)
    room.send("carry", "small box")
    assert source.extend()
    assert "**carry: small box**" in source.status(1) and "walks around" in source.status(1)
    assert "0 reached, 0 falls" in source.status(1)
    curves = source.curves()
    assert curves.error_m is not None and len(curves.error_m) == 2 and curves.terms == {}
    with pytest.raises(ConfigError, match="save the room as a page"):
        source.take()


def test_a_page_of_it_draws_every_piece() -> None:
    source = RoomFrames(rooms.room())
    for _ in range(3):
        source.extend()
    moving = source.poses(2)
    names = [source.model.body(i).name for i in range(source.model.nbody)]
    assert sum(name.startswith("furniture") for name in names) >= 8
    assert np.isfinite(moving[[not n.startswith("projectile") for n in names]]).all()
    text = page(source, "a <room>", "test")
    assert "a &lt;room&gt;" in text and text.count('"kind":"box"') > 30
