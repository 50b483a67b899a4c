"""Carrying: hands at the box, and balance."""

import numpy as np

from tests.support.world.synthetic import Posed
from world.motions.synthetic import rotations, skeleton


def test_hands_press_the_box_and_it_keeps_clear_of_floor_and_trunk(every: list[Posed]) -> None:
    boxes = [(one, one.clip.box) for one in every if one.clip.box is not None]
    assert len(boxes) >= 12
    for one, box in boxes:
        hands = one.positions[:, [5, 8]]
        apart = np.linalg.norm(hands[:, 1] - hands[:, 0], axis=-1)[box.held]
        assert np.abs(apart - box.size_m[1] - 0.08).max() < 0.015, one.clip.name
        off = np.linalg.norm(hands.mean(1) - box.pose[:, :3], axis=-1)[box.held]
        assert off.max() < 0.005, one.clip.name
        # the task ends where a box is within 30 cm of the floor
        assert (box.pose[:, 2] - 0.5 * box.size_m[2]).min() > 0.30, one.clip.name
        turned = rotations.matrix(box.pose[:, 3:].astype(np.float64))
        for body, up, radius in ((0, 0.205, 0.07), (1, 0.12, 0.11)):
            centre = one.positions[:, body] + up * one.world[:, body, :, 2]
            inside = np.einsum("tji,tj->ti", turned, centre - box.pose[:, :3])
            beyond = np.maximum(np.abs(inside) - 0.5 * np.array(box.size_m), 0.0)
            distance = np.linalg.norm(beyond, axis=-1) - radius
            assert distance[box.held].min() > -0.02, (one.clip.name, body)


def test_body_and_box_balance_over_the_feet_while_lifting(every: list[Posed]) -> None:
    for one in every:
        box = one.clip.box
        if box is None:
            continue
        held = np.flatnonzero(box.held)
        mass = skeleton.centre_of_mass(one.positions, one.world)
        for frame in (held[0] - 10, held[0] - 2, held[-1] + 4, held[-1] + 12):
            yaw = one.world[frame, 0, :2, 0]
            ahead = yaw / np.linalg.norm(yaw)
            ankle = one.positions[frame, [11, 14], :2].mean(0)
            over = (mass[frame, :2] - ankle) @ ahead
            assert skeleton.HEEL_M < over < skeleton.TOE_M, (one.clip.name, frame)
