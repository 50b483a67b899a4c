"""Goals: targets and entries of turned pieces by hand, and boxes that are lost."""

import math

import numpy as np
import pytest
import torch

from console.demo.goals import FloorGoal, Thing, UseGoal, nearest, sides
from console.kinds.poses import HERE
from console.kinds.setup import Pose
from tests.support.console import rooms
from world.furniture import catalogue
from world.furniture.usage import use_points


def thing(name: str, pose: Pose) -> Thing:
    return Thing(name, catalogue.find(name), 3, pose, pose)


def test_the_target_of_a_turned_chair() -> None:
    chair = thing("chair-test-000", Pose(1.0, 2.0, math.pi / 2))
    (goal,) = sides("sit", "sit: chair", chair, "sit")
    (use,) = use_points(chair.piece, "sit")
    target = goal.target(rooms.room().scenes)
    x, y, z = use.point_m
    # a quarter turn: its +x is the world's +y
    assert target.point[0].tolist() == pytest.approx([1.0 - y, 2.0 + x, z], abs=1e-5)
    assert target.facing[0].tolist() == pytest.approx([0.0, 1.0], abs=1e-6)
    assert goal.surface_m == pytest.approx(z, abs=1e-6)
    front = chair.piece.bounds()[1][0]
    assert goal.entry() == pytest.approx([1.0 - y, 2.0 + front + 0.4], abs=1e-5)


def test_a_bed_has_an_entry_on_each_side_and_the_nearer_one_is_taken() -> None:
    bed = thing("bed-test-002", Pose(0.0, 0.0, 0.0))
    goals = sides("lie", "lie: bed", bed, "lie")
    assert len(goals) == 2
    assert sorted(math.copysign(1, goal.entry()[1]) for goal in goals) == [-1, 1]
    assert nearest(goals, np.array([0.0, -3.0])).entry()[1] < 0 < nearest(
        goals, np.array([0.0, 3.0])
    ).entry()[1]  # fmt: skip
    assert isinstance(goals[0], UseGoal)


def test_a_box_is_lost_on_the_floor_and_its_target_is_the_top_of_the_stand() -> None:
    room = rooms.room()
    room.send("carry", "small box")
    goal = room.control.goal
    free = room.stands[2]
    half = room.box_poses()["small box"][1][2]
    target = goal.target(room.scenes)
    assert target.point[0].tolist() == pytest.approx(
        [free.pose.x, free.pose.y, free.up_m + half], abs=1e-5
    )
    assert not goal.lost(room.scenes)  # pyright: ignore[reportAttributeAccessIssue]
    at = torch.tensor([[0.0, 1.0, half, 1.0, 0.0, 0.0, 0.0]])
    room.scenes.set_free(HERE, 1, at, torch.zeros(1, 6))
    assert goal.lost(room.scenes)  # pyright: ignore[reportAttributeAccessIssue]
    moved = goal.target(room.scenes)
    assert moved.box is not None and moved.box.position[0].tolist() == pytest.approx([0, 1, half])


def test_the_policy_of_carry_takes_over_near_the_box() -> None:
    room = rooms.room()
    room.send("carry", "large box")
    goal, box = room.control.goal, np.array(room.box_poses()["large box"][0][:2])
    assert goal.takes_over(box + np.array([1.0, 0.0])) and not goal.takes_over(
        box + np.array([2.0, 0.0])
    )
    assert FloorGoal("walk", "", Pose(0.0, 0.0)).takes_over(box)
