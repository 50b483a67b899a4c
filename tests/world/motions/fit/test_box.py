"""The box of a clip is found where it was."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.support.world.objects_in_clips import a_carry, angle_deg, shaken
from world import rotations
from world.motions.clip import Clip
from world.motions.fit import poses
from world.motions.fit.box import _from_the_bend, find_box


@pytest.mark.parametrize(
    ("seed", "width_m", "heights_m"),
    [(0, 0.4, (0.4, 0.7)), (1, 0.3, (0.34, 0.34)), (2, 0.5, (0.75, 0.36))],
)
def test_the_box_is_found_within_two_centimetres(
    seed: int, width_m: float, heights_m: tuple[float, float]
) -> None:
    clip = a_carry(seed, width_m, heights_m)
    known, found = clip.box, find_box(replace(clip, box=None))
    assert known is not None and found is not None
    off = np.linalg.norm(found.pose[:, :3] - known.pose[:, :3], axis=1)
    assert off.max() < 0.02
    assert angle_deg(found.pose[:, 3:], known.pose[:, 3:]).max() < 5.0
    assert found.size_m[1] == pytest.approx(width_m, abs=0.02)
    for edge in (0, -1):
        ours, theirs = np.flatnonzero(found.held)[edge], np.flatnonzero(known.held)[edge]
        assert abs(int(ours) - int(theirs)) <= 6


def test_a_found_box_rests_moves_smoothly_and_is_rigid_in_the_hands(carried: Clip) -> None:
    box = find_box(replace(carried, box=None))
    assert box is not None
    first, last = np.flatnonzero(box.held)[[0, -1]]
    for rest in (box.pose[:first], box.pose[last + 1 :]):
        assert np.abs(rest - rest[0]).max() < 1e-6
    velocity = np.diff(box.pose[:, :3], axis=0) * carried.fps
    # nothing jumps at grasp or release: no step of more than 0.3 m/s from frame to frame
    assert np.abs(np.diff(velocity, axis=0)).max() < 0.3
    position, _ = poses.body_poses(carried)
    hands = position[:, [5, 8]].numpy()
    rotation = rotations.matrix(torch.from_numpy(box.pose[:, 3:])).numpy()
    inside = np.einsum("tji,thj->thi", rotation, hands - box.pose[:, None, :3])[box.held]
    assert np.ptp(inside, axis=0).max() < 0.03


def test_a_shaken_box_is_found_too(carried: Clip) -> None:
    known = carried.box
    found = find_box(replace(shaken(carried, 0.003, np.deg2rad(0.5)), box=None))
    assert known is not None and found is not None
    off = np.linalg.norm(found.pose[:, :3] - known.pose[:, :3], axis=1)
    assert np.median(off) < 0.02
    assert off.max() < 0.06


def test_hands_that_rise_as_far_apart_as_the_box_is_wide_have_let_go() -> None:
    """Heights of the hands by hand: down to the box, still for a moment, and up again."""
    down, up = np.linspace(0.9, 0.3, 40), np.linspace(0.3, 0.6, 20)
    apart = np.full(60, 0.35)
    assert _from_the_bend(apart, np.concatenate((down, up)), 0, 55, 30) == (0, 40)
    # the mirror image in time: they come down as wide as the box, take it and lift it
    lifted = np.concatenate((up[::-1], down[::-1]))
    assert _from_the_bend(apart, lifted, 5, 60, 30) == (19, 60)
    # a box that is put up on a shelf, where the hands are still, is held to the end
    still = np.concatenate((down, np.linspace(0.3, 0.9, 15), np.full(5, 0.9)))
    assert _from_the_bend(apart, still, 0, 58, 30) == (0, 58)
    # and one that is in hand at the clip's begin was not taken in it
    assert _from_the_bend(apart, lifted, 0, 60, 30)[0] == 0
