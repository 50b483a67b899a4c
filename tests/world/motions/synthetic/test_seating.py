"""Seats: the pelvis rests on them, the feet before them."""

import numpy as np

from tests.support.world.synthetic import Posed
from world.motions.clip import Seat
from world.motions.synthetic import skeleton
from world.motions.synthetic.sitting import ROOT_ABOVE_SEAT_M


def test_pelvis_rests_on_the_seat_facing_its_way(
    sits: list[tuple[Posed, Seat]],
) -> None:
    for one, seat in sits:
        clip, positions, world = one.clip, one.positions, one.world
        seated = slice(seat.from_frame, seat.to_frame)
        assert 3.0 <= (seat.to_frame - seat.from_frame) / clip.fps <= 6.1, clip.name
        height = positions[seated, 0, 2] - seat.point_m[2] - ROOT_ABOVE_SEAT_M
        assert np.abs(height).max() < 0.01, clip.name
        assert np.abs(positions[seated, 0, :2] - seat.point_m[:2]).max() < 0.01, clip.name
        yaw = np.arctan2(world[seated, 0, 1, 0], world[seated, 0, 0, 0])
        assert np.abs(np.angle(np.exp(1j * (yaw - seat.facing_rad)))).max() < 0.1, clip.name


def test_feet_stand_flat_from_sitting_down_to_standing_up(
    sits: list[tuple[Posed, Seat]],
) -> None:
    for one, seat in sits:
        clip, positions, world = one.clip, one.positions, one.world
        span = slice(seat.from_frame - 40, seat.to_frame + 35)
        for side in (0, 1):
            corners = skeleton.sole_corners(positions, world, side)[span]
            assert np.abs(corners[..., 2]).max() < 0.001, clip.name
            assert np.ptp(corners[..., :2], axis=0).max() < 0.001, clip.name
