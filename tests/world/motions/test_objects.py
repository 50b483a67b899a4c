"""Objects put back into clips: against known truth, through noise, files, cuts and mirrors."""

from dataclasses import replace

import numpy as np

from tests.support.world.objects_in_clips import angle_deg
from world.motions.clip import Clip, mirrored
from world.motions.fit.box import find_box
from world.motions.objects import Skeleton


def test_cutting_keeps_objects_in_step(carried: Clip, lain: Clip) -> None:
    assert carried.box is not None and lain.bed is not None
    part = carried.part(100, 300)
    assert part.box is not None and part.frames == 200
    np.testing.assert_array_equal(part.box.pose, carried.box.pose[100:300])
    middle = (lain.bed.from_frame + lain.bed.to_frame) // 2
    half = lain.part(middle, lain.frames)
    assert half.bed is not None
    assert (half.bed.from_frame, half.bed.to_frame) == (0, lain.bed.to_frame - middle)
    assert lain.part(0, 10).bed is None


def test_mirroring_mirrors_every_object(carried: Clip, lain: Clip) -> None:
    ghost = Skeleton(("a",), (-1,), np.ones((lain.frames, 1, 3), np.float32))
    twice = mirrored(mirrored(replace(lain, ghost=ghost)))
    assert twice.bed == lain.bed
    assert twice.ghost is not None and (twice.ghost.position_m == 1).all()
    once = mirrored(carried)
    known = carried.box
    assert once.box is not None and known is not None
    # what the mirrored hands carry is the mirrored box
    found = find_box(replace(once, box=None))
    assert found is not None
    assert np.linalg.norm(found.pose[:, :3] - once.box.pose[:, :3], axis=1).max() < 0.02
    assert angle_deg(found.pose[:, 3:], once.box.pose[:, 3:]).max() < 5.0
    back = mirrored(once).box
    assert back is not None
    np.testing.assert_array_equal(back.pose, known.pose)
