"""What may be done when: the past is not touched, a file is not pushed, and the old scene stays."""

import math

import pytest

from console.kinds.setup import Pose, Setup
from console.play.session import Session
from tests.support.console.players import live, stock
from world.errors import ChoiceError, ConfigError, InhabitError


def test_a_scene_is_touched_at_its_front_alone() -> None:
    session = Session(live(), stock())
    for _ in range(5):
        session.player.source.extend()
    session.player.seek(2)
    for touch in (
        session.throw,
        lambda: session.push(10.0, 0.0, "torso"),
        lambda: session.move(Pose(1.0, 1.0)),
    ):
        with pytest.raises(ConfigError, match="this moment is past"):
            touch()
    session.player.seek(5)
    session.throw()
    with pytest.raises(ConfigError, match="finite numbers"):
        session.push(math.nan, 0.0, "torso")


def test_a_new_scene_keeps_the_speed_and_a_wrong_one_keeps_the_old() -> None:
    session = Session(live(), stock())
    session.player.run(2.0)
    old = session.player.source
    with pytest.raises(InhabitError):
        session.begin(Setup("sit", "throne"))
    assert session.player.source is old and session.opened == 0
    session.begin(stock().first())
    assert session.opened == 1 and session.player.speed == 2.0
    with pytest.raises(ChoiceError, match="unknown take 'b': choose one of a"):
        session.use({"a": old}, "b")
    session.use({"a": old}, "a")
    assert session.player.source is old and session.opened == 2


def test_without_a_stock_there_are_no_scenes() -> None:
    with pytest.raises(ConfigError, match="a file is played"):
        Session(live()).begin(stock().first())
