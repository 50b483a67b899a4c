"""Whatever a raw clip uses: a box, beds or seats, fitted to how it moves."""

from world.motions.clip import Clip
from world.motions.fit.bed import with_beds
from world.motions.fit.box import with_box
from world.motions.fit.floor import floor_mended, resampled
from world.motions.fit.seat import with_seats


def known(clip: Clip) -> list[str]:
    """The kinds of object that a clip knows: `seat`, `bed`, `box`."""
    return [kind for kind in ("seat", "bed", "box") if getattr(clip, kind) is not None]


def grounded(clip: Clip) -> Clip:
    """A raw clip at 30 Hz on the floor; one that brings its objects along stays as it is."""
    return clip if known(clip) else floor_mended(resampled(clip))


def with_any(clip: Clip) -> list[Clip]:
    """A clip at 30 Hz, on the floor, in parts with whatever they use: a box, beds, or seats.

    A clip that brings its objects along stays as it is.
    """
    if known(clip):
        return [clip]
    ready = grounded(clip)
    carried = with_box(ready)
    if carried[0].box is not None:
        return carried
    lain = with_beds(ready)
    if lain[0].bed is not None:
        return lain
    return with_seats(ready) or lain
