"""The character in a room: from goal to goal without a reset, around pieces, helped up, and boxes
that are put back."""

import itertools
import math

import numpy as np
import pytest
import torch

from console.demo.floor_plan import Footprint
from console.demo.layout import furnished
from console.demo.room import GOAL_M, Room, Stage
from console.kinds.poses import HERE
from console.kinds.setup import Pose
from tests.support.console import rooms
from tests.support.console.rooms import run
from world.errors import ChoiceError, ConfigError


def test_it_goes_from_goal_to_goal_without_a_reset() -> None:
    """The seat, then a point of the floor: the root never jumps, and a hand helps it up."""
    room, stages = rooms.room(2), set()
    assert not room.done
    room.send("sit", "chair")
    before, far = room.scenes.qpos[0, :3].clone(), 0.0
    for goal in range(2):
        for _ in range(900):
            room.step()
            now = room.scenes.qpos[0, :3].clone()
            far, before = max(far, float((now - before).norm())), now
            stages.add((goal, room.control.stage))
            if room.done:
                break
        assert room.done, f"goal {goal} was not reached in 30 s"
        assert room.error_m() <= 0.2
        if goal == 0:
            seat = float(now[2])
            room.walk(Pose(0.0, 0.5, 0.0))
            assert not room.done and room.control.stage is Stage.HELP
    assert seat < 0.65 < float(now[2]), "it sat, and it stands"
    assert far < 0.2, "at most 6 m/s: nothing is put elsewhere"
    assert (1, Stage.HELP) in stages and (1, Stage.TASK) in stages
    assert room.control.reached == 2


def test_it_walks_around_what_stands_in_the_way() -> None:
    room = rooms.room(2)
    table = room.things["table"]
    table.pose = table.wanted = Pose(1.4, 0.0, math.pi / 2)
    room.scenes.move_piece(HERE, table.index, *table.origin())
    room._plan = None
    room.walk(Pose(2.6, 0.0, 0.0))
    assert room.control.stage is Stage.WALK and len(room.control.way) > 1
    steps, nearest = 0, math.inf
    footprint = Footprint.of(table.piece, table.pose)
    while room.control.stage is Stage.WALK and steps < 450:
        room.step()
        steps += 1
        nearest = min(nearest, float(footprint.distance_m(room.root())))
    assert room.control.falls == 0 and 0.1 < nearest < 0.8, "past the table, not through it"
    assert run(room, 600) < 600


def test_names_are_checked() -> None:
    room = rooms.room()
    assert room.goals()["walk"] == []
    assert set(room.goals()["carry"]) == {"large box", "small box"}
    assert {"chair", "armchair", "stool", "high stool"} <= set(room.goals()["sit"])
    assert "table" not in room.goals()["sit"]
    assert {"sofa", "bed"} <= set(room.goals()["lie"])
    with pytest.raises(ChoiceError, match="piece"):
        room.send("sit", "table")
    with pytest.raises(ChoiceError, match="choose one of carry, lie, sit, walk"):
        room.send("fly", "bed")
    with pytest.raises(ChoiceError, match="piece"):
        room.move("piano", Pose(0.0, 0.0))
    with pytest.raises(ConfigError, match="within 20 m"):
        room.move("bed", Pose(21.0, 0.0))
    with pytest.raises(ConfigError, match="finite"):
        room.move("bed", Pose(math.nan, 0.0))
    with pytest.raises(ChoiceError, match="body"):
        room.push(np.zeros(3), "wing")


def test_it_needs_a_policy_that_walks() -> None:
    only = {name: p for name, p in rooms.policies().items() if name != "walk"}
    with pytest.raises(ConfigError, match="a policy that walks"):
        Room(only, furnished(0))


def test_a_lost_box_is_put_back_on_a_stand() -> None:
    room = rooms.room()
    room.send("carry", "large box")
    half = room.box_poses()["large box"][1][2]
    down = torch.tensor([[0.0, 1.5, half, 1.0, 0.0, 0.0, 0.0]])
    room.scenes.set_free(HERE, 0, down, torch.zeros(1, 6))
    assert room.stand_of(0) is None
    for _ in range(75):
        room.step()
    stand = room.stand_of(0)
    assert stand is not None and stand is not room.stand_of(1)


def test_only_the_policy_of_carry_has_the_contacts_of_boxes() -> None:
    room = rooms.room()
    room.step()
    calm = room.scenes.models[0]
    room.send("carry", "small box")
    seen = set()
    for _ in range(240):
        room.step()
        seen.add((room.control.stage, room.scenes.models[0] is calm))
    assert (Stage.WALK, True) in seen and (Stage.TASK, False) in seen
    assert (Stage.TASK, True) not in seen and (Stage.WALK, False) not in seen


def test_a_push_is_felt_and_a_moment_repeats_bit_for_bit() -> None:
    room = rooms.room()
    moment = room.step()

    def after(push: float) -> torch.Tensor:
        room.restore(moment, 1)
        room.push(np.array([push, 0.0, 0.0]), "torso")
        for _ in range(15):
            found = room.step()
        assert found.error_m == pytest.approx(room.error_m() * GOAL_M / 0.2)
        return found.physics["qpos"]

    calm = after(0.0)
    assert torch.equal(calm, after(0.0))
    assert float((after(60.0) - calm)[0, 0]) > 0.1


def test_it_chooses_by_its_seed() -> None:
    def chosen(seed: int) -> list[str]:
        room, found = rooms.room(), []
        room._random = np.random.default_rng(seed)
        for _ in range(6):
            room.send_anywhere()
            found.append(room.control.goal.label)
        return found

    assert chosen(1) == chosen(1) != chosen(2)
    one = chosen(3)
    assert all(a != b for a, b in itertools.pairwise(one)), "another one each time"
