"""Captions name task, piece, time and what has happened."""

from dataclasses import replace

import numpy as np

from console.video import caption
from tests.support.console.recordings import take

ONE = replace(
    take(90),
    meta={"stages": {"approached": 30, "touched": 45}, "success_at_step": 60, "fell_at_step": None},
)


def test_the_last_event_is_shown() -> None:
    found = [caption.stage_at(ONE, frame) for frame in (0, 29, 30, 50, 60, 89)]
    assert found == ["", "", "approached", "touched", "success", "success"]
    fell = replace(ONE, meta=ONE.meta | {"fell_at_step": 70})
    assert [caption.stage_at(fell, frame) for frame in (69, 70)] == ["success", "fell"]
    assert caption.stage_at(take(4), 3) == ""


def test_the_text_has_the_time_in_seconds() -> None:
    assert caption.text_of(ONE, 45, "sit") == f"sit  ·  {ONE.piece}  ·  1.5 s  ·  touched"
    assert caption.text_of(ONE, 0) == f"{ONE.piece}  ·  0.0 s"


def test_text_is_dark_on_light_and_stays_in_the_image() -> None:
    image = np.full((120, 160, 3), 90, np.uint8)
    found = caption.drawn(image, "a text that is longer than the image is wide " * 3)
    assert found.shape == image.shape and (image == 90).all()
    changed = (found != image).any(axis=2)
    assert found[changed].max() > 180 and found[changed].min() < 80
    assert not changed[:100].any()
    assert caption.drawn(image, "") is image
