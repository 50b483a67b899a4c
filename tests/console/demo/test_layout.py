"""Furnished rooms: nothing overlaps, the middle is free, and a seed is a room."""

import numpy as np
import pytest

from console.demo.floor_plan import FloorPlan, Footprint
from console.demo.layout import Layout, furnished
from console.kinds.setup import Pose
from world.config import CarryConfig
from world.scene.box import STAND

SEEDS = range(12)
#: The points at which two footprints could overlap, in units of the half edges.
GRID = np.stack(np.meshgrid(*[np.linspace(-1, 1, 21)] * 2), axis=-1).reshape(-1, 2)


def footprints(layout: Layout) -> list[Footprint]:
    pieces = [Footprint.of(p.piece, p.pose) for p in layout.pieces]
    return [*pieces, *(Footprint.of(STAND, pose) for pose in layout.stands)]


def covered(footprint: Footprint) -> np.ndarray:
    turn = np.array(
        [
            [np.cos(footprint.yaw), -np.sin(footprint.yaw)],
            [np.sin(footprint.yaw), np.cos(footprint.yaw)],
        ]
    )
    return np.array(footprint.centre) + (GRID * np.array(footprint.half)) @ turn.T


@pytest.mark.parametrize("seed", SEEDS)
def test_pieces_keep_apart_and_the_middle_is_free(seed: int) -> None:
    layout = furnished(seed)
    found = footprints(layout)
    for i, one in enumerate(found):
        for other in found[i + 1 :]:
            assert other.distance_m(covered(one)).min() > 0.25
    plan = FloorPlan(found)
    assert plan.free(np.array([[layout.start.x, layout.start.y], [0.0, 0.0]])).all()
    ring = np.stack((np.cos(np.arange(0, 6.3, 0.2)), np.sin(np.arange(0, 6.3, 0.2))), axis=1)
    assert plan.free(1.2 * ring).all()


def test_a_seed_is_a_room() -> None:
    assert furnished(3) == furnished(3) != furnished(4)
    assert len({p.piece.name for seed in SEEDS for p in furnished(seed).pieces}) > 20
    assert all("-test-" in p.piece.name for p in furnished(0).pieces)


def test_every_box_has_a_stand_and_one_is_free() -> None:
    layout = furnished(0)
    assert len(layout.stands) == len(layout.boxes) + 1
    low, high = CarryConfig().stand_m
    assert low <= layout.stand_m <= high
    numbers = [x for p in layout.pieces for x in (p.pose.x, p.pose.y, p.pose.yaw)]
    assert all(type(x) is float for x in numbers) and isinstance(layout.start, Pose)
