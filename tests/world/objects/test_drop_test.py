"""A seated ragdoll comes to rest on every seat at the height that the piece gives, at all sizes."""

from dataclasses import replace

import numpy as np
import pytest

from world.furniture.catalogue import find, whole
from world.furniture.piece import Box, Piece, SeatTarget
from world.objects.drop_test import drop

#: One of every construction or so; docs/results/furniture.md has the figures of all.
PIECES = [p for p in (*whole("train")[:49:2], *whole("test")[:28:3]) if p.sit]
CLASSES = ("chair", "armchair", "low-stool", "high-stool", "sofa", "bed")


@pytest.mark.parametrize("scale", [0.8, 1.0, 1.2])
@pytest.mark.parametrize("piece", PIECES, ids=lambda p: p.name)
def test_a_ragdoll_comes_to_rest_on_the_seat(piece: Piece, scale: float) -> None:
    rest = drop(piece.scaled(scale), seconds=3.0)
    assert rest.finite
    assert abs(rest.height_error_m) < 0.03
    assert rest.deepest_m < 0.015
    assert rest.speed_m_s < 0.1
    assert rest.off_m < 0.25
    assert rest.rests


@pytest.mark.parametrize("scale", [0.8, 1.0, 1.2])
@pytest.mark.parametrize("name", CLASSES)
def test_nothing_explodes_in_ten_seconds(name: str, scale: float) -> None:
    rest = drop(find(f"{name}-train-004").scaled(scale), seconds=10.0)
    assert rest.rests
    assert rest.fastest_m_s < 1.5


def test_a_wrong_target_is_refused() -> None:
    """The oracle itself: too high, in the air, turned against the back, beside the seat."""
    slab = (Box((0.0, 0.0, 0.43), (0.25, 0.25, 0.02)), Box((-0.25, 0.0, 0.7), (0.02, 0.25, 0.3)))
    chair = Piece("chair", "chair", slab, (SeatTarget((0.0, 0.0, 0.45)),), 5.0)
    right = drop(chair)
    assert right.rests
    # it sinks in by the softness of the contact alone
    assert abs(right.height_error_m) < 0.005
    high = drop(replace(chair, sit=(SeatTarget((0.0, 0.0, 0.50)),)))
    assert not high.rests
    assert high.height_error_m == pytest.approx(-0.05, abs=0.01)
    assert not drop(replace(chair, sit=(SeatTarget((0.0, 0.0, 0.45), np.pi),))).rests
    assert not drop(replace(chair, sit=(SeatTarget((0.30, 0.0, 0.45)),))).rests
