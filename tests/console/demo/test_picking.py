"""Clicks: rays by hand."""

import math

import numpy as np
import pytest

from console.demo.picking import Block, picked

CUBE = Block((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0), (2.0, 0.0, 0.0), 0.0)


def ray(*numbers: float) -> np.ndarray:
    return np.array(numbers)


def test_where_a_ray_enters() -> None:
    assert CUBE.hit_m(ray(0, 0, 0.5), ray(1, 0, 0)) == pytest.approx(1.5)
    assert CUBE.hit_m(ray(0, 0, 0.5), ray(-1, 0, 0)) == math.inf, "behind"
    assert CUBE.hit_m(ray(0, 0, 1.5), ray(1, 0, 0)) == math.inf, "above"
    turned = Block(CUBE.low, CUBE.high, CUBE.origin, math.pi / 4)
    assert turned.hit_m(ray(0, 0, 0.5), ray(1, 0, 0)) == pytest.approx(2 - math.sqrt(0.5))


def test_the_nearest_thing_is_picked_else_the_floor() -> None:
    blocks = {"near": CUBE, "far": Block(CUBE.low, CUBE.high, (4.0, 0.0, 0.0), 0.0)}
    along = ray(1, 0, -0.1)
    assert picked(blocks, ray(0, 0, 0.6), along) == ("near", pytest.approx((1.5, 0.0)))
    assert picked({"far": blocks["far"]}, ray(0, 0, 0.6), along) == (
        "far",
        pytest.approx((3.5, 0.0)),
    )
    assert picked(blocks, ray(0, 3, 2), ray(0.5, 0, -1)) == ("", pytest.approx((1.0, 3.0)))
    assert picked(blocks, ray(0, 3, 2), ray(0, 0, 1)) is None, "the sky"
