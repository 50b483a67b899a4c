"""The tracked box: its axes named, held when it is in the hands, and measured against the box that
hands alone give."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.samp_clips import FOLDER
from world.motions.fit.box import find_box
from world.motions.formats import registry
from world.motions.formats.recording import RecordedBox
from world.motions.retarget import tracked
from world.motions.retarget.body import Targets
from world.motions.retarget.convert import retargeted

OMOMO = FOLDER.parent / "omomo"
FRAMES, LIFT, DOWN = 90, 30, 70


def lifted(size: tuple[float, float, float], turn: Rotation) -> tuple[RecordedBox, Targets]:
    """A box on the floor that two hands at its sides lift from frame 30 to 70; its own axes are
    `turn` from x ahead, y to the left, z up, and its edges `size` along those named axes."""
    height = np.interp(np.arange(FRAMES), [0, LIFT, 50, DOWN, FRAMES], [0, 0, 0.8, 0, 0])
    centre = np.stack((0.4 + 0 * height, 0 * height, 0.5 * size[2] + height), axis=1)
    away = np.interp(np.arange(FRAMES), [0, 20, 80, FRAMES], [0.6, 0.0, 0.0, 0.6])
    hands = np.stack(
        [centre + np.stack((-away, s * (0.5 * size[1] + 0.03) + 0 * away, away), axis=1)
         for s in (-1, 1)], axis=1,
    )  # fmt: skip
    axes = np.tile(turn.as_matrix(), (FRAMES, 1, 1))
    own = np.abs(turn.as_matrix().T @ np.array(size))
    rest = np.tile(np.eye(3), (FRAMES, 15, 1, 1))
    target = Targets(np.zeros((FRAMES, 3)), rest, np.zeros((FRAMES, 2, 3)), hands)
    x, y, z = (float(edge) for edge in own)
    return RecordedBox(centre, axes, (x, y, z)), target


@pytest.mark.parametrize("angles", [(0, 0, 0), (90, 0, 0), (0, 180, 90), (270, 90, 0)])
def test_axes_are_named_by_hands_and_gravity(angles: tuple[float, float, float]) -> None:
    size = (0.3, 0.5, 0.35)
    box, target = lifted(size, Rotation.from_euler("xyz", angles, degrees=True))
    track = tracked.track(box, target, np.zeros(3))
    np.testing.assert_allclose(track.size_m, size, atol=1e-9)
    np.testing.assert_allclose(np.abs(track.pose[:, 3]), 1.0, atol=1e-6)
    np.testing.assert_allclose(track.pose[:, :3], box.position, atol=1e-6)


def test_a_box_is_held_while_it_is_off_the_floor_in_both_hands() -> None:
    box, target = lifted((0.3, 0.5, 0.35), Rotation.identity())
    held = tracked.track(box, target, np.zeros(3)).held
    first, last = np.flatnonzero(held)[[0, -1]]
    assert held[first : last + 1].all()
    assert LIFT - 4 <= first <= LIFT + 1 and DOWN - 1 <= last <= DOWN + 4
    # nobody at it
    away = replace(target, hand=target.hand + 2.0)
    assert not tracked.track(box, away, np.zeros(3)).held.any()


def test_joints_that_are_lowered_take_the_box_along_but_not_into_the_floor() -> None:
    box, target = lifted((0.3, 0.5, 0.35), Rotation.identity())
    drop = np.array([0, 0, 0.03])
    track = tracked.track(box, replace(target, hand=target.hand - drop), drop)
    assert track.pose[:, 2].min() == pytest.approx(0.175)
    np.testing.assert_allclose(track.pose[45:55, 2], box.position[45:55, 2] - 0.03, atol=1e-6)


@pytest.mark.skipif(not OMOMO.is_dir(), reason="no ../shared/motions/omomo")
@pytest.mark.parametrize("name", ["sub10_largebox_049", "sub3_largebox_003"])
def test_the_box_of_the_hands_is_the_tracked_one_within_two_centimetres(name: str) -> None:
    recording = registry.read(OMOMO / f"{name}.pt")
    clip = retargeted(recording)
    known = clip.box
    assert known is not None and recording.box is not None
    # the file's own box, as large relative to the person, and as far away
    scale = known.size_m[1] / 0.338
    assert sorted(known.size_m) == pytest.approx(
        sorted(s * scale for s in (0.335, 0.338, 0.36)), rel=0.01
    )
    travel = np.linalg.norm(np.ptp(recording.box.position[:, :2], axis=0))
    assert np.linalg.norm(np.ptp(known.pose[:, :2], axis=0)) == pytest.approx(
        scale * travel, rel=0.01
    )
    found = find_box(replace(clip, box=None))
    assert found is not None
    assert np.abs(np.array(found.size_m) - known.size_m).max() < 0.02
    both = found.held & known.held
    assert both.sum() > 0.9 * known.held.sum()
    off = np.linalg.norm(found.pose[both, :3] - known.pose[both, :3], axis=1)
    assert np.median(off) < 0.02
