"""Text on pictures, in the letters that the font has.

The font that comes with the library draws an empty box for others, and names of users hold them.
"""

import unicodedata
from functools import cache

from PIL import Image, ImageDraw, ImageFont

_MISSING = "\U0010ffff"
"""A character that no font has"""
_UNKNOWN = "?"

Font = ImageFont.FreeTypeFont | ImageFont.ImageFont


@cache
def font(size: float = 10.0) -> Font:
    """Return the font of pictures, with letters of a size in pixels."""
    return ImageFont.load_default(size)


def legible(text: str) -> str:
    """Return a text whose letters the font has: others without their accents, else as '?'."""
    return "".join(map(_letter, unicodedata.normalize("NFC", text)))


@cache
def _letter(letter: str) -> str:
    if _drawn(letter):
        return letter
    plain = "".join(
        part for part in unicodedata.normalize("NFKD", letter) if not unicodedata.combining(part)
    )
    return plain if plain and all(map(_drawn, plain)) else _UNKNOWN


@cache
def _drawn(letter: str) -> bool:
    """Whether the font has a letter."""
    if letter.isspace():
        return True
    return _pixels(letter) != _pixels(_MISSING)


def _pixels(letter: str) -> bytes:
    """A letter as it is drawn."""
    image = Image.new("L", (32, 32))
    ImageDraw.Draw(image).text((8, 8), letter, fill=255, font=font())
    return image.tobytes()
