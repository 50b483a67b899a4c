"""Captions on images: task, piece, time and stage."""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from console import lettering
from console.recording.format import Take
from world.character.model import CONTROL_HZ

_TEXT, _PLATE = (32, 36, 42), (255, 255, 255, 190)
#: Size of the text, and margins around it, as fractions of the image's height.
_SIZE, _MARGIN, _PAD = 0.036, 0.03, 0.016


def text_of(take: Take, frame: int, task: str = "") -> str:
    """Return the caption of a control step: "sit · chair-12 · 3.2 s · touched"."""
    words = [task, take.piece, f"{frame / CONTROL_HZ:.1f} s", stage_at(take, frame)]
    return "  ·  ".join(word for word in words if word)


def stage_at(take: Take, frame: int) -> str:
    """Return the last event of a take up to a control step: a stage, success, or a fall; empty
    before the first."""
    events = dict(take.meta.get("stages") or {})
    success, fell = take.meta.get("success_at_step"), take.meta.get("fell_at_step")
    events |= {"success": success} if success is not None else {}
    events |= {"fell": fell} if fell is not None else {}
    past = [(int(step), name) for name, step in events.items() if int(step) <= frame]
    for last in ("fell", "success"):
        if any(name == last for _, name in past):
            return last
    return max(past, key=lambda event: event[0])[1] if past else ""


def drawn(image: NDArray[np.uint8], text: str) -> NDArray[np.uint8]:
    """Return an image [height, width, 3] with a line of text at its lower left."""
    if not text:
        return image
    height = image.shape[0]
    plate = _plate(text, height)
    margin = round(_MARGIN * height)
    top = height - margin - plate.shape[0]
    part = image[top : top + plate.shape[0], margin : margin + plate.shape[1]]
    plate = plate[: part.shape[0], : part.shape[1]]
    share = plate[..., 3:] / 255.0
    found = image.copy()
    found[top : top + plate.shape[0], margin : margin + plate.shape[1]] = (
        share * plate[..., :3] + (1.0 - share) * part
    ).astype(np.uint8)
    return found


@cache
def _plate(text: str, height: int) -> NDArray[np.uint8]:
    """Return the text on its plate [h, w, 4]."""
    font, text = lettering.font(max(9.0, _SIZE * height)), lettering.legible(text)
    pad = max(2, round(_PAD * height))
    left, top, right, bottom = font.getbbox(text)
    size = (round(right - left) + 2 * pad, round(bottom - top) + 2 * pad)
    plate = Image.new("RGBA", size, _PLATE)
    ImageDraw.Draw(plate).text((pad - left, pad - top), text, fill=_TEXT, font=font)
    return np.asarray(plate)
