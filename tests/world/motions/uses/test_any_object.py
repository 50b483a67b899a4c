"""Any object: a clip's box, else its bed, else its seat."""

from dataclasses import replace

import pytest
import torch

from world.motions.clip import Clip
from world.motions.uses.any_object import ANY
from world.motions.uses.bed import BED
from world.motions.uses.box import BOX
from world.motions.uses.seat import SEAT
from world.motions.uses.use import ClipUse


@pytest.mark.parametrize(("name", "use"), [("carried", BOX), ("lain", BED), ("sitting", SEAT)])
def test_the_use_is_that_of_the_clips_object(
    name: str, use: ClipUse, request: pytest.FixtureRequest
) -> None:
    clip: Clip = request.getfixturevalue(name)
    found, wanted = ANY.read(clip), use.read(clip)
    assert found.has_object and torch.equal(found.stage, wanted.stage)
    assert torch.equal(found.point, wanted.point) and torch.equal(found.facing, wanted.facing)
    assert ANY.accepts(clip) and ANY.prepare(clip) == [clip]


def test_a_clip_without_an_object_is_taken_too(sitting: Clip) -> None:
    bare = replace(sitting, seat=None)
    assert ANY.accepts(bare) and not ANY.read(bare).has_object
