"""Tasks take the clips that they can use."""

from dataclasses import replace

import pytest

from tests.support.samp_clips import FOLDER, needs_samp
from world.motions import load
from world.motions.clip import Clip
from world.motions.objects import Bed
from world.motions.uses.bed import BED
from world.motions.uses.box import BOX
from world.motions.uses.seat import SEAT


def test_tasks_take_what_they_use(carried: Clip, lain: Clip) -> None:
    bare = replace(lain, bed=None)
    assert isinstance(BED.prepare(bare)[0].bed, Bed)
    assert SEAT.prepare(bare) == []
    assert BOX.prepare(carried)[0] is carried
    assert BED.prepare(carried) == []


@needs_samp
@pytest.mark.parametrize("name", ["chair_mo006", "run_side"])
def test_mocap_without_a_box_or_a_bed_has_none(name: str) -> None:
    path = str(FOLDER / f"{name}.npz")
    assert all(clip.box is None for clip in load.clips((path,), BOX))
    assert all(clip.bed is None for clip in load.clips((path,), BED))
