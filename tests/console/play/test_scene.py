"""The scene of the player: its setup, and furniture that moves."""

import math

import numpy as np
import pytest

from console.kinds.setup import Pose, Setup
from console.play.scene import STEP_S, Scene
from console.play.session import Session
from tests.support.console.players import POLICIES, live, qpos, stock
from world.errors import ConfigError
from world.tasks.sit import HIP_ABOVE_SEAT_M


def test_furniture_glides_and_takes_the_goal_along() -> None:
    source = live()
    seat = source.scene.piece.sit[0].point_m[2] + HIP_ABOVE_SEAT_M

    def error(moment_goal: Pose) -> float:
        root = qpos(source, len(source) - 1)[:3]
        return float(np.linalg.norm(root - [moment_goal.x, moment_goal.y, seat]))

    first = source.moments[0].physics["mocap_pos"][0].numpy().reshape(-1, 3)[0].copy()
    Session(source).move(Pose(2.5, 4.0, math.pi))
    for _ in range(20):
        assert source.extend()
    goal = source.moments[-1].goal
    assert (goal.x, goal.y) == pytest.approx((2.5, 1.5 * 20 * STEP_S))
    moved = source.moments[-1].physics["mocap_pos"][0].numpy().reshape(-1, 3)[0]
    np.testing.assert_allclose(moved - first, [0.0, 1.0, 0.0], atol=1e-6)
    assert source.moments[-1].error_m == pytest.approx(error(goal), abs=1e-4)
    for _ in range(80):
        assert source.extend()
    assert (source.scene.goal.x, source.scene.goal.y) == pytest.approx((2.5, 4.0))
    with pytest.raises(ConfigError, match="within 20 m"):
        source.scene.move(Pose(99.0, 0.0))


def test_a_goal_turns_the_shorter_way() -> None:
    turned = Pose(0, 0, 3.0).stepped(Pose(3, 4, -3.0), 2.5, 0.1)
    assert (turned.x, turned.y, turned.yaw) == pytest.approx((1.5, 2.0, 3.1))


def test_a_scene_belongs_to_its_setup() -> None:
    served = POLICIES["sit"]
    piece = stock().piece("sit", next(iter(stock().pieces("sit"))), 1.2)
    scene = Scene(served, piece, Setup("sit", piece.name, 1.2))
    assert scene.model.geom("slot0").size == pytest.approx(np.array(piece.boxes[0].half_m))
