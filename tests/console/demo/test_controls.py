"""The demo's controls, used without a browser: goals, clicks, and furniture that is moved."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from console.demo.controls import RoomControls
from console.demo.source import RoomFrames
from console.play.session import Session
from tests.support.console import rooms
from tests.support.console.rooms import Used, used
from world.errors import ConfigError


def click(view: Used, controls: RoomControls, x: float, y: float, z: float) -> None:
    """A click from above the room at a point."""
    eye = np.array([0.0, -7.0, 5.0])
    shift = np.array([*view.offset, 0.0])
    heard: list[str] = []
    event: Any = SimpleNamespace(
        ray_origin=tuple(eye + shift),
        ray_direction=tuple(np.array([x, y, z]) - eye),
        client=SimpleNamespace(add_notification=lambda *words, **_: heard.append(words[1])),
    )
    controls._clicked(event)
    assert not heard, heard


def test_goals_clicks_and_moves() -> None:
    room = rooms.room(2)
    room.wanders = True
    source = RoomFrames(room)
    session = Session(source)
    with used(session) as view:
        controls = RoomControls(view, room, "*Not here: nothing.*")
        view.use("sit", "armchair")
        assert room.control.goal.label == "sit: armchair" and not room.wanders
        view.use("let it choose", True)
        assert room.wanders
        view.use("walk", "the middle")
        assert room.control.goal.entry() == pytest.approx([0.0, 0.0]) and not room.wanders

        for name, policy in (("bed", "lie"), ("chair", "sit"), ("high stool", "sit")):
            thing = room.things[name]
            click(view, controls, thing.pose.x, thing.pose.y, 0.3)
            assert room.control.goal.label == f"{policy}: {name}"
        click(view, controls, *room.box_poses()["small box"][0])
        assert room.control.goal.label == "carry: small box"
        click(view, controls, 0.7, -0.4, 0.0)
        assert room.control.goal.entry() == pytest.approx([0.7, -0.4])
        # the scene is moved while the character is followed: the same point is meant
        view._world.position = (1.5, 0.5, 0.0)
        click(view, controls, 0.7, -0.5, 0.0)
        assert room.control.goal.entry() == pytest.approx([0.7, -0.5])

        view.use("piece", "table")
        x, y = room.things["table"].pose.x, room.things["table"].pose.y
        view.use("x, y (m)", (x + 0.5, y))
        view.use("turn (°)", 90)
        assert room.things["table"].wanted.x == pytest.approx(x + 0.5, abs=0.01)
        assert room.things["table"].wanted.yaw == pytest.approx(math.pi / 2)
        session.player.advance(0.1)
        session.player.seek(0)
        with pytest.raises(ConfigError, match="in the past"):
            view.use("sit", "chair")
