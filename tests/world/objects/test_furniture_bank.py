"""A bank of pieces: sizes spread evenly, seats within reach, and places where they are told."""

import math

import numpy as np
import pytest
import torch

from world.errors import PieceError
from world.furniture.catalogue import catalogue, find
from world.objects.furniture_bank import MAX_SEAT_M, FurnitureBank, scaled, variants


def test_no_seat_is_scaled_out_of_reach() -> None:
    stool = find("high-stool-train-000")
    height = stool.sit[0].point_m[2]
    assert scaled(stool, 5.0).sit[0].point_m[2] == pytest.approx(MAX_SEAT_M)
    assert scaled(stool, 0.9).sit[0].point_m[2] == pytest.approx(0.9 * height)


def test_every_band_of_sizes_is_there() -> None:
    stool = find("low-stool-train-000")
    found = variants([stool] * 7, 4, (0.8, 1.2))
    scales = np.array([piece.size_m[2] / stool.size_m[2] for piece in found]).reshape(7, 4)
    bands = np.floor((scales - 0.8) / 0.1 + 1e-9)
    assert (bands == np.arange(4)).all() and len(np.unique(scales.round(6))) == 28


def test_a_stated_target_is_kept() -> None:
    bank = FurnitureBank(variants(catalogue("train", 4), 2, (0.8, 1.2)))
    variant = torch.arange(len(bank))
    angle = torch.linspace(-3, 3, len(bank))
    facing = torch.stack((angle.cos(), angle.sin()), 1)
    point = torch.randn(len(bank), 2, generator=torch.Generator().manual_seed(0))
    place = bank.target(variant, point, facing)
    origin, yaw = bank.placed(variant, point, facing)
    for row, piece in enumerate(bank.pieces):
        turn = math.atan2(yaw[row, 1], yaw[row, 0])
        seat = piece.sit[0]
        x, y, z = seat.point_m
        wanted = [
            origin[row, 0] + x * math.cos(turn) - y * math.sin(turn),
            origin[row, 1] + x * math.sin(turn) + y * math.cos(turn),
            z,
        ]
        np.testing.assert_allclose(place.point[row], wanted, atol=1e-5)
        assert math.remainder(turn + seat.facing_rad - float(angle[row]), 2 * math.pi) == (
            pytest.approx(0.0, abs=1e-5)
        )
        assert float(place.corners[row, :, 2].max()) == pytest.approx(piece.size_m[2], abs=1e-5)


def test_the_nearest_heights_are_chosen() -> None:
    bank = FurnitureBank(variants(catalogue("train", 12), 4, (0.8, 1.2)))
    heights = bank.point[:, 2]
    chosen = bank.of_height(torch.full((40,), 0.45), torch.linspace(0, 0.999, 40))
    near = heights[(heights - 0.45).abs().argsort()[: len(bank) // 6]]
    assert near.min() <= heights[chosen].min() and heights[chosen].max() <= near.max()


def test_only_beds_keep_a_standing_character_off_their_footprint() -> None:
    bed, chair = (
        FurnitureBank([find("bed-train-000")], "lie"),
        FurnitureBank([find("chair-train-000")]),
    )
    zero, here = torch.zeros(1, dtype=torch.int64), torch.zeros(1, 2)
    facing = torch.tensor([[1.0, 0.0]])
    offset = torch.tensor([[-0.2, 0.0]])
    assert torch.equal(chair.clear_of(zero, offset, facing, torch.tensor([False])), offset)
    pushed = bed.clear_of(zero, offset, facing, torch.tensor([False]))
    assert float(bed.beyond(zero, -pushed, here, facing)) == pytest.approx(0.35, abs=1e-5)
    assert float(bed.beyond(zero, here, here, facing)) < 0.0
    assert float(chair.beyond(zero, here, here, facing)) == -math.inf


def test_what_has_no_place_is_refused() -> None:
    with pytest.raises(PieceError, match="choose at least one piece"):
        FurnitureBank([])
    with pytest.raises(PieceError, match="has no place to lie"):
        FurnitureBank([find("chair-train-000")], "lie")


@pytest.mark.parametrize("name", ["sofa-train-003", "sofa-train-009", "sofa-train-015"])
def test_who_begins_before_an_l_shaped_sofa_stands_clear_of_its_chaise(name: str) -> None:
    """0.4-1.3 m before the edge within 60 degrees of the facing, as initial states are drawn: in
    the notch or before it, the root more than 0.15 m from every box."""
    bank = FurnitureBank([find(name)], "lie")
    distance, angle = torch.meshgrid(
        torch.linspace(0.4, 1.3, 10), torch.linspace(-math.pi / 3, math.pi / 3, 13), indexing="ij"
    )
    offset = -distance.flatten()[:, None] * torch.stack(
        (angle.flatten().cos(), angle.flatten().sin()), dim=1
    )
    n = len(offset)
    facing, zero = torch.tensor([[1.0, 0.0]]).expand(n, -1), torch.zeros(n, dtype=torch.int64)
    root = -bank.clear_of(zero, offset, facing, torch.ones(n, dtype=torch.bool))
    assert float((root[:, 0] - bank.ground.edge).min()) > 0.15
    for box in bank.pieces[0].boxes:
        corners = box.corners()[:, :2] - bank.point[0, :2].numpy()
        low, high = corners.min(axis=0), corners.max(axis=0)
        beyond = np.maximum(np.maximum(low - root.numpy(), root.numpy() - high), 0.0)
        assert np.linalg.norm(beyond, axis=1).min() > 0.15
