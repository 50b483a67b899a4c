"""The box of a clip is found where it was."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.support.world.objects_in_clips import a_carry, angle_deg, shaken
from world import rotations
from world.motions.clip import Clip
from world.motions.fit import poses
from world.motions.fit.box import find_box


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
