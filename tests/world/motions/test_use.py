"""Tasks take the clips that they can use."""

from dataclasses import replace

import pytest

from tests.support.samp_clips import FOLDER, needs_samp
from world.errors import ChoiceError
from world.motions import load
from world.motions.clip import Clip
from world.motions.fit import ground
from world.motions.fit.bed import find_beds
from world.motions.fit.box import find_box
from world.motions.objects import Bed


def test_tasks_take_what_they_use(carried: Clip, lain: Clip) -> None:
    bare = replace(lain, bed=None)
    assert isinstance(ground.with_objects(bare, "lie")[0].bed, Bed)
    assert ground.with_objects(bare, "sit") == []
    assert ground.with_objects(carried, "carry")[0] is carried
    assert ground.with_objects(carried, "lie") == []
    with pytest.raises(ChoiceError, match="carry, lie, sit"):
        ground.with_objects(carried, "dance")


def test_what_walks_carries_nothing() -> None:
    walks = [c for c in load.own_clips() if not (c.box or c.seat or c.bed)][:12]
    assert [c.name for c in walks if find_box(c) is not None] == []
    assert [c.name for c in walks if find_beds(c)] == []


@needs_samp
@pytest.mark.parametrize("name", ["chair_mo006", "run_side"])
def test_mocap_without_a_box_or_a_bed_has_none(name: str) -> None:
    path = str(FOLDER / f"{name}.npz")
    assert all(clip.box is None for clip in load.clips((path,), "carry"))
    assert all(clip.bed is None for clip in load.clips((path,), "lie"))
