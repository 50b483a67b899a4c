"""The free floor: distances by hand, and ways around a wall."""

import itertools
import math

import numpy as np
import pytest

from console.demo.floor_plan import CELL_M, CLEARANCE_M, FloorPlan, Footprint
from console.kinds.setup import Pose
from world.furniture.piece import Box, Piece

WALL = Footprint((0.0, 0.0), (0.1, 1.0), 0.0)


def point(x: float, y: float) -> np.ndarray:
    return np.array([x, y])


def test_distances_from_a_turned_rectangle() -> None:
    turned = Footprint((1.0, 2.0), (0.5, 0.25), math.pi / 2)  # covers x 0.75-1.25, y 1.5-2.5
    points = np.array([[1.0, 2.4], [1.0, 3.5], [2.25, 2.0], [1.25 + 3.0, 2.5 + 4.0]])
    assert turned.distance_m(points) == pytest.approx([0.0, 1.0, 1.0, 5.0])


def test_the_footprint_of_a_piece_whose_boxes_are_beside_its_origin() -> None:
    piece = Piece("p", "p", (Box((1.0, 0.0, 0.5), (0.5, 0.25, 0.5)),), (), 1.0)
    found = Footprint.of(piece, Pose(2.0, 3.0, math.pi / 2))
    assert found.centre == pytest.approx((2.0, 4.0)) and found.half == pytest.approx((0.5, 0.25))


def test_the_shortest_way_goes_around_a_wall() -> None:
    plan = FloorPlan([WALL])
    begin, end = point(-2.0, 0.0), point(2.0, 0.0)
    assert not plan.clear(begin, end)
    way = [begin, *plan.way(begin, end)]
    assert np.allclose(way[-1], end)
    for here, there in itertools.pairwise(way):
        between = here + np.linspace(0, 1, 50)[:, None] * (there - here)
        assert (WALL.distance_m(between) >= CLEARANCE_M - CELL_M / 2).all()
    length = sum(math.dist(a, b) for a, b in itertools.pairwise(way))
    # past both corners, with the clearance: the tangents of two quarter circles of 0.35 m
    corner = math.hypot(2.0 - 0.1, 1.0)
    assert corner * 2 < length < 2 * corner + 1.0


def test_a_free_line_is_the_way() -> None:
    (end,) = FloorPlan([WALL]).way(point(-2.0, 2.0), point(2.0, 2.0))
    assert np.allclose(end, [2.0, 2.0])


def test_who_stands_close_to_a_piece_may_walk_away_from_it_but_not_through() -> None:
    plan = FloorPlan([WALL])
    close = point(0.2, 0.0)
    assert not bool(plan.free(close))
    assert plan.clear(close, point(2.0, 0.0)) and not plan.clear(close, point(-2.0, 0.0))


def test_the_nearest_free_point() -> None:
    plan = FloorPlan([WALL])
    found = plan.nearest_free(point(0.15, 0.0))
    assert bool(plan.free(found)) and math.dist(found, (0.45, 0.0)) < CELL_M
    assert np.allclose(plan.nearest_free(point(3.0, 3.0)), [3.0, 3.0])


def test_without_a_way_it_is_straight() -> None:
    ring = [
        Footprint((1.0 * x, 1.0 * y), (1.1, 0.1) if y else (0.1, 1.1), 0.0)
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))
    ]
    (end,) = FloorPlan(ring).way(point(0.0, 0.0), point(4.0, 0.0))
    assert np.allclose(end, [4.0, 0.0])
