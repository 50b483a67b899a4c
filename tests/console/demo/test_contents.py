"""The things of a room: stands with their boxes, and the floor plan that follows them."""

import numpy as np
import pytest

from console.kinds.setup import Pose
from tests.support.console import rooms


def test_boxes_move_with_their_stand() -> None:
    room = rooms.room()
    stand = room.stands[0]
    room.move("stand 1", Pose(stand.pose.x + 0.6, stand.pose.y, 0.0))
    for _ in range(30):
        room.step()
    assert room.stand_of(0) is stand
    assert room.box_poses()["large box"][0][0] == pytest.approx(stand.pose.x, abs=0.02)
    assert stand.pose == stand.wanted


def test_every_box_begins_on_its_stand_and_stays_there() -> None:
    room = rooms.room()
    room.walk(Pose(0.5, 0.0, 0.0))
    for _ in range(30):
        room.step()
    assert [room.stand_of(i) for i in range(2)] == room.stands[:2]
    (_, _, z), (_, _, half), _ = room.box_poses()["small box"]
    assert z == pytest.approx(room.stands[1].up_m + half, abs=0.01)


def test_the_floor_plan_follows_what_moves() -> None:
    room = rooms.room()
    table = room.things["table"]
    there = np.zeros(2)
    before = np.array([table.pose.x, table.pose.y])
    assert not bool(room.plan().free(before)) and bool(room.plan().free(there))
    room.move("table", Pose(0.0, 0.0, 0.0))
    room.walk(Pose(-1.5, 0.0, 0.0))
    for _ in range(90):
        room.step()
    assert table.pose == table.wanted
    assert bool(room.plan().free(before)) and not bool(room.plan().free(there))
