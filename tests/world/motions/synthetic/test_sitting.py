"""Sitting down and standing up as people do it."""

import numpy as np
import pytest

from tests.support.world.synthetic import Posed
from world.motions.clip import Seat
from world.motions.synthetic import skeleton


def test_weight_is_over_the_feet_until_shortly_before_the_seat(
    sits: list[tuple[Posed, Seat]],
) -> None:
    for one, seat in sits:
        clip, positions, world = one.clip, one.positions, one.world
        ahead = np.array([np.cos(seat.facing_rad), np.sin(seat.facing_rad)])
        mass = skeleton.centre_of_mass(positions, world)[:, :2] @ ahead
        ankle = positions[:, [11, 14], :2].mean(1) @ ahead
        down = slice(seat.from_frame - 45, seat.from_frame - 12)
        up = slice(seat.to_frame + 12, seat.to_frame + 40)
        for stretch in (down, up):
            over = (mass - ankle)[stretch]
            assert over.min() > skeleton.HEEL_M - 0.015 and over.max() < skeleton.TOE_M, clip.name


def test_trunk_flexes_as_people_do_and_hands_rest_on_the_thighs(
    sits: list[tuple[Posed, Seat]],
) -> None:
    for one, seat in sits:
        clip, positions, world = one.clip, one.positions, one.world
        flexion = np.degrees(
            np.arcsin(
                np.clip(
                    world[:, 1, 0, 2] * np.cos(seat.facing_rad)
                    + world[:, 1, 1, 2] * np.sin(seat.facing_rad),
                    -1,
                    1,
                )
            )
        )
        rising = flexion[seat.to_frame - 20 : seat.to_frame + 20].max()
        assert 35.0 < rising < 46.0, clip.name
        middle = (seat.from_frame + seat.to_frame) // 2
        assert -10.5 < flexion[middle] < 6.0, clip.name
        for hand, thigh in ((5, 9), (8, 12)):
            axis = -world[middle, thigh, :, 2]
            offset = positions[middle, hand] - positions[middle, thigh]
            along = offset @ axis
            assert 0.2 < along < 0.4, clip.name
            assert np.linalg.norm(offset - along * axis) == pytest.approx(0.105, abs=0.015), (
                clip.name
            )
