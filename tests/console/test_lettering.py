"""Text on pictures has no empty boxes."""

import numpy as np
import pytest

from console import lettering
from console.objects import sheet
from console.video import caption
from tests.support.world.meshes import built


@pytest.mark.parametrize(
    ("text", "drawn"),
    [
        ("sit  \u00b7  chair-12  \u00b7  3.2 s", "sit  \u00b7  chair-12  \u00b7  3.2 s"),
        ("hocker-\u00fc-\u00e9", "hocker-u-e"),
        ("hocker-u\u0308", "hocker-u"),
        ("\u6905\u5b50", "??"),
        ("two\nlines", "two\nlines"),
    ],
)
def test_letters_that_the_font_lacks_are_written_in_others(text: str, drawn: str) -> None:
    assert lettering.legible(text) == drawn


def test_sheets_and_captions_are_legible() -> None:
    """As with the letters that stand for others."""
    from dataclasses import replace

    piece = built().piece
    there, instead = (sheet.sheet([replace(piece, name=name)]) for name in ("\u00fc", "u"))
    assert there.tobytes() == instead.tobytes()
    blank = np.zeros((240, 320, 3), np.uint8)
    assert np.array_equal(caption.drawn(blank, "\u00fc 1 s"), caption.drawn(blank, "u 1 s"))
