"""Seats of clips: stages of their use, and seats that policies' clips get."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from world.motions.clip import Clip
from world.motions.uses.seat import SEAT
from world.motions.uses.use import APPROACH, CONTACT
from world.scene.target import Target


def test_the_seat_is_the_same_through_the_clip(sitting: Clip) -> None:
    used, seat = SEAT.read(sitting), sitting.seat
    assert seat is not None and used.has_object
    assert torch.equal(used.point, torch.tensor([seat.point_m]).expand(sitting.frames, 3))
    assert (used.stage[seat.from_frame : seat.to_frame] == CONTACT).float().mean() > 0.9
    assert set(used.stage.tolist()) == {0, 1, 2} and int(used.stage[0]) == APPROACH
    yaw = torch.atan2(used.facing[:, 1], used.facing[:, 0])
    assert float((yaw[0] - seat.facing_rad).cos()) == pytest.approx(1.0, abs=1e-6)
    nothing = SEAT.read(replace(sitting, seat=None))
    assert not nothing.has_object and not nothing.point.any()


def test_a_clip_of_a_policy_gets_the_seat_of_its_target(sitting: Clip) -> None:
    point, facing = torch.tensor([[1.0, 2.0, 0.4]]), torch.tensor([[0.0, 1.0]])
    target = Target(point, facing, torch.zeros(1, 8, 3))
    seat = SEAT.with_object(replace(sitting, seat=None), target, (3, 9)).seat
    assert seat is not None and (seat.from_frame, seat.to_frame) == (3, 9)
    assert seat.point_m == pytest.approx((1.0, 2.0, 0.4))
    assert seat.facing_rad == pytest.approx(np.pi / 2)
