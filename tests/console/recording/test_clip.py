"""Takes as clips: the same poses, box and reference."""

import numpy as np

from console.recording.clip import clip_of, reference_of
from tests.support.console.moving_takes import carried, followed, pushed


def test_a_take_is_a_clip_of_the_same_poses() -> None:
    take = pushed()
    clip = clip_of(take, "a", "b", "c")
    np.testing.assert_allclose(clip.qpos(), take.qpos, atol=1e-5)
    assert (clip.name, clip.source, clip.licence, clip.fps) == ("a", "b", "c", 30)
    assert clip.box is None and reference_of(take, clip) is None


def test_a_box_comes_along() -> None:
    take = carried()
    held = np.arange(len(take)) > 4
    clip = clip_of(take, "a", "b", "c", held=held)
    assert clip.box is not None
    np.testing.assert_allclose(clip.box.pose, take.qpos[:, 43:], atol=1e-6)
    np.testing.assert_allclose(clip.box.size_m, (0.35, 0.5, 0.3))
    np.testing.assert_array_equal(clip.box.held, held)


def test_a_reference_is_a_clip_too() -> None:
    take = followed()
    clip = clip_of(take, "a", "b", "c")
    reference = reference_of(take, clip)
    assert reference is not None
    np.testing.assert_allclose(reference.qpos(), take.ghost, atol=1e-5)
