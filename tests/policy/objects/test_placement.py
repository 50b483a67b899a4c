"""Furniture of messages: where its place comes to be, and what cannot stand."""

import math

import numpy as np
import pytest

from policy.errors import RequestError
from policy.objects import placement
from policy.objects.columns import COLUMNS, POSE_WIDTH
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import SIT, chair
from world import tasks
from world.furniture.catalogue import find


def test_a_place_turns_and_moves_with_its_piece() -> None:
    yaw = 0.8
    row = np.zeros(POSE_WIDTH)
    placement.fill_target(row, placement.placed_furniture(chair(2.0, -1.0, yaw), SIT))
    seat = find("chair-test-000").sit[0]
    x, y, z = seat.point_m
    wanted = [
        2.0 + x * math.cos(yaw) - y * math.sin(yaw),
        -1.0 + x * math.sin(yaw) + y * math.cos(yaw),
        z,
    ]
    np.testing.assert_allclose(row[COLUMNS["point"]], wanted, atol=1e-9)
    facing = yaw + seat.facing_rad
    np.testing.assert_allclose(row[COLUMNS["facing"]], [math.cos(facing), math.sin(facing)])
    corners = row[COLUMNS["corners"]].reshape(8, 3)
    assert np.ptp(corners[:, 2]) == pytest.approx(find("chair-test-000").size_m[2])


def test_scales_scale_the_piece() -> None:
    message = chair()
    message.scale = 1.1
    found = placement.placed_furniture(message, SIT)
    height = find("chair-test-000").sit[0].point_m[2]
    assert found.use_point.point_m[2] == pytest.approx(1.1 * height)
    message.scale = 6.0
    with pytest.raises(RequestError, match=r"^furniture\.scale: 6\.0, must be 0\.2 to 5$"):
        placement.placed_furniture(message, SIT)


def test_a_custom_shape_is_one_box_round_everything() -> None:
    shape = pb.Shape(low=[-0.2, -0.3, 0.0], high=[0.2, 0.3, 0.5], hip=[0.0, 0.0, 0.5])
    piece, spot = placement.custom(shape, SIT)
    (box,) = piece.boxes
    assert box.half_m == pytest.approx((0.2, 0.3, 0.25))
    assert box.centre_m == pytest.approx((0.0, 0.0, 0.25))
    assert spot.point_m == spot.head_m == (0.0, 0.0, 0.5)
    with pytest.raises(RequestError, match=r"furniture\.custom\.head: 0 numbers"):
        placement.custom(shape, tasks.make("lie"))
    flat = pb.Shape(low=[0.0, 0.0, 0.0], high=[1.0, 1.0, 0.0], hip=[0.0, 0.0, 0.5])
    with pytest.raises(RequestError, match=r"must be above .* by a millimetre"):
        placement.custom(flat, SIT)


def test_places_are_counted_and_needed() -> None:
    message = chair()
    message.place = 3
    with pytest.raises(RequestError, match=r"^furniture\.place: 3, must be 0 to 0$"):
        placement.placed_furniture(message, SIT)
    with pytest.raises(RequestError, match="has no place to lie"):
        placement.placed_furniture(chair(), tasks.make("lie"))
    with pytest.raises(RequestError, match=r"^furniture: must have a piece"):
        placement.placed_furniture(pb.Furniture(), SIT)
