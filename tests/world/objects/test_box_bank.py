"""Boxes to carry: their sizes and weights, where they rest, and that they move with their stand."""

import numpy as np
import pytest
import torch

from world.config import CarryConfig
from world.errors import ConfigError, PieceError
from world.furniture.catalogue import find
from world.objects.box_bank import BoxBank, boxes, resting
from world.scene.batch import Scenes
from world.scene.box import BOX_KG

HERE = torch.arange(2)
YAW = torch.tensor([[1.0, 0.0], [0.0, 1.0]])


def test_sizes_are_spread_and_weights_do_not_follow_them() -> None:
    by_volume = boxes(CarryConfig(scale=(0.5, 1.5), sizes=10))
    edges = np.array([2 * piece.boxes[0].half_m[1] for piece in by_volume])
    np.testing.assert_allclose(np.diff(edges), 0.05)
    assert by_volume[5].mass_kg == pytest.approx(BOX_KG * (edges[5] / 0.5) ** 3)
    drawn = boxes(CarryConfig(sizes=200, weight_kg=(1.0, 12.0)))
    weights = np.array([piece.mass_kg for piece in drawn])
    assert 1.0 <= weights.min() < 1.2 and 11.8 < weights.max() <= 12.0
    assert abs(np.corrcoef(weights, range(200))[0, 1]) < 0.1


@pytest.mark.parametrize("wrong", [{"scale": (1.5, 0.5)}, {"sizes": 0}, {"weight_kg": (5.0, 1.0)}])
def test_empty_ranges_are_refused(wrong: dict) -> None:
    with pytest.raises(ConfigError, match=r"^carry\."):
        boxes(CarryConfig(**wrong))
    with pytest.raises(PieceError):
        BoxBank([])
    with pytest.raises(PieceError, match="is no box to carry"):
        BoxBank([find("chair-train-000")])


def test_the_nearest_widths_are_chosen() -> None:
    bank = BoxBank(boxes(CarryConfig(sizes=12)))
    u = torch.linspace(0, 0.999, 50)
    chosen = bank.of_width(torch.full((50,), 0.5), u)
    widths = 2 * bank.half[:, 1]
    near = (widths - 0.5).abs().argsort()[:4]
    assert set(chosen.tolist()) <= set(near.tolist()) and len(set(chosen.tolist())) == 3


def test_a_box_that_rests_goes_with_its_stand_and_one_in_hand_does_not() -> None:
    bank = BoxBank(boxes(CarryConfig(sizes=2)))
    scenes = Scenes([bank.models[0], bank.models[0]], 0.35, 3.0)
    at = torch.tensor([[2.0, 0.0, 0.7], [2.0, 1.0, 0.7]])
    layout = resting(at, YAW, at + 1.0)
    variant = torch.zeros(2, dtype=torch.int64)
    bank.apply(scenes, HERE, variant, layout)
    np.testing.assert_allclose(scenes.free_qpos[:, :3], at)
    top = scenes.physics()["mocap_pos"][:, 0, 2]
    np.testing.assert_allclose(top, 0.7 - bank.half[0, 2], atol=1e-6)
    scenes.free_qpos[1, 2] += 0.3  # lifted
    moved = bank.shift(scenes, HERE, variant, layout, at[:, :2] - 1.0, YAW)
    np.testing.assert_allclose(scenes.free_qpos[0, :3], [1.0, -1.0, 0.7], atol=1e-6)
    np.testing.assert_allclose(scenes.free_qpos[1, :3], [2.0, 1.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(moved.start, at - torch.tensor([1.0, 1.0, 0.0]))
    assert torch.equal(moved.target, layout.target)


def test_the_goal_holds_the_corners() -> None:
    bank = BoxBank(boxes(CarryConfig(sizes=2)))
    at = torch.tensor([[0.0, 0.0, 1.0]])
    place = bank.target(torch.tensor([1]), resting(at, YAW[1:], at + 2.0))
    depth, width, height = bank.half[1].tolist()
    assert place.corners[0].amax(0).tolist() == pytest.approx([width, depth, 1.0 + height])
    assert torch.equal(place.point, at + 2.0)
