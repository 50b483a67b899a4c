"""Beds of clips: when they are used, higher ones for the discriminator, those of policies."""

import numpy as np
import pytest
import torch

from world.motions.clip import Clip
from world.motions.mixture import StyleMixture
from world.motions.uses.bed import BED
from world.motions.uses.use import CONTACT
from world.scene.target import Target


def test_the_bed_is_used_where_the_clip_lies(lain: Clip) -> None:
    used, bed = BED.read(lain), lain.bed
    assert bed is not None and used.has_object
    torch.testing.assert_close(used.head[0], torch.tensor(bed.head_m, dtype=torch.float32))
    assert (used.stage[bed.from_frame : bed.to_frame] == CONTACT).all()


def test_only_lying_characters_are_raised() -> None:
    own, root = torch.zeros(3, 105), torch.tensor([[0, 0, 0.9], [0, 0, 0.6], [0, 0, 0.3]])
    mixture = StyleMixture(raised_m=(0.1, 0.3))
    raised, at = BED.raised(own, root, torch.full((3,), 0.5), mixture)
    up = torch.tensor([0.0, 0.2, 0.2])
    torch.testing.assert_close(at[:, 2] - root[:, 2], up)
    torch.testing.assert_close(raised[:, 0], up)
    assert not raised[:, 1:].any() and torch.equal(at[:, :2], root[:, :2])


def test_a_clip_of_a_policy_gets_the_bed_of_its_target(lain: Clip) -> None:
    hip, head = torch.tensor([[1.0, 2.0, 0.4]]), torch.tensor([[1.0, 2.7, 0.5]])
    target = Target(hip, torch.tensor([[-1.0, 0.0]]), torch.zeros(1, 8, 3), head)
    bed = BED.with_object(lain, target, (5, 7)).bed
    assert bed is not None and (bed.from_frame, bed.to_frame) == (5, 7)
    assert bed.head_m == pytest.approx((1.0, 2.7, 0.4))  # as high as the hip's place
    assert abs(bed.facing_rad) == pytest.approx(np.pi)
