"""The carried box in the player."""

import numpy as np
import pytest

from console.kinds.setup import Pose
from tests.support.console.players import live, qpos


def test_a_box_stands_on_its_stand_and_its_goal_moves() -> None:
    source = live("carry", box=Pose(1.0, 0.5))
    assert qpos(source, 0)[43:45] == pytest.approx([1.0, 0.5])
    source.scene.move(Pose(2.5, 0.5))
    for _ in range(15):
        assert source.extend()
    stands = source.moments[-1].physics["mocap_pos"][0].numpy().reshape(-1, 3)
    assert stands[0, :2] == pytest.approx([1.0, 0.5]) and stands[1, :2] == pytest.approx([2.5, 0.5])
    box = qpos(source, 15)[43:46]
    goal = [2.5, 0.5, stands[1, 2] + source.scene.piece.boxes[0].half_m[2]]
    assert source.moments[-1].error_m == pytest.approx(float(np.linalg.norm(box - goal)), abs=1e-4)
