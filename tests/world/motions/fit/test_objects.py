"""Clips get the objects that they use, and no others."""

from world.motions import load
from world.motions.clip import Clip
from world.motions.fit.bed import find_beds
from world.motions.fit.box import find_box
from world.motions.fit.objects import grounded, known, with_any


def test_a_clip_that_brings_its_objects_stays_as_it_is(carried: Clip, lain: Clip) -> None:
    assert (known(carried), known(lain)) == (["box"], ["bed"])
    assert grounded(carried) is carried
    assert with_any(lain) == [lain]


def test_what_walks_carries_nothing() -> None:
    walks = [c for c in load.own_clips() if not (c.box or c.seat or c.bed)][:12]
    assert [c.name for c in walks if find_box(c) is not None] == []
    assert [c.name for c in walks if find_beds(c)] == []
