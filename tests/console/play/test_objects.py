"""Beds and boxes in the player."""

import math

import numpy as np
import pytest
from console.play.setup import Pose, Setup
from world.objects.targets import use_points

from tests.support.console.players import live, qpos, stock
from world.errors import ConfigError


def test_a_bed_has_a_side_of_its_own_choice() -> None:
    both = [n for n, p in stock().pieces("lie").items() if len(use_points(p, "lie")) == 2]
    beds = [n for n in both if n.startswith("bed")]  # single ones: a double bed has one side
    found = []
    for side in (0, 1):
        source = stock().begin(Setup("lie", beds[0], side=side, goal=Pose(3.0, 0.0, 0.5)))
        place = source.scene._object.place(source.scene._scenes)
        assert place.facing[0].tolist() == pytest.approx([math.cos(0.5), math.sin(0.5)])
        # the head is to the left of one side and to the right of the other
        assert place.head is not None
        along = (place.head - place.point)[0, :2].numpy()
        found.append(np.cross([*place.facing[0].numpy(), 0.0], [*along, 0.0])[2])
    assert found[0] * found[1] < 0
    with pytest.raises(ConfigError, match="has sides 0 to 1"):
        stock().begin(Setup("lie", beds[0], side=2))


def test_a_box_stands_where_it_should_and_its_goal_moves() -> None:
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
