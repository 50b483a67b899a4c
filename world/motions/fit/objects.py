"""Objects of any kind, fitted to a raw clip: a box, beds or seats."""

from world.motions.clip import Clip
from world.motions.fit.bed import with_beds
from world.motions.fit.box import with_box
from world.motions.fit.floor import floor_corrected, resampled
from world.motions.fit.seat import with_seats


def annotated(clip: Clip) -> list[str]:
    """The annotated objects of a clip: of `seat`, `bed`, `box`."""
    return [kind for kind in ("seat", "bed", "box") if getattr(clip, kind) is not None]


def grounded(clip: Clip) -> Clip:
    """A raw clip at 30 Hz on the floor; an annotated one is unchanged."""
    return clip if annotated(clip) else floor_corrected(resampled(clip))


def with_any(clip: Clip) -> list[Clip]:
    """The parts of a clip at 30 Hz, on the floor, with their objects: a box, beds, or seats.

    An annotated clip is unchanged.
    """
    if annotated(clip):
        return [clip]
    ready = grounded(clip)
    carried = with_box(ready)
    if carried[0].box is not None:
        return carried
    lain = with_beds(ready)
    if lain[0].bed is not None:
        return lain
    return with_seats(ready) or lain
