"""Actions become set-points by one formula, in whatever precision, and back."""

import pytest
import torch

from world.character import model as character
from world.character.actions import ActionMap
from world.config import WorldConfig

WORLD = WorldConfig()
LOW, HIGH = (torch.from_numpy(bound) for bound in character.set_point_bounds())
NEUTRAL = torch.from_numpy(character.neutral_set_points())


def mapping(dtype: torch.dtype = torch.float64) -> ActionMap:
    return ActionMap.of(WORLD.action_scale, WORLD.action_clip, dtype)


def test_action_one_is_a_share_of_the_range_beyond_the_mean_pose() -> None:
    found = mapping().set_points(torch.stack((torch.zeros(28), torch.full((28,), 0.1))))
    torch.testing.assert_close(found[0], NEUTRAL)
    torch.testing.assert_close(found[1], NEUTRAL + 0.1 * 0.35 * (HIGH - LOW), atol=1e-7, rtol=0)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_set_points_stay_within_bounds_whatever_the_action(dtype: torch.dtype) -> None:
    ours = mapping(dtype)
    beyond = ours.set_points(torch.tensor([[50.0], [-50.0]], dtype=dtype).expand(2, 28))
    assert beyond.dtype == dtype
    assert (beyond <= ours.high).all() and (beyond >= ours.low).all()
    # 0.35 * 3 of the range reaches at least one bound of each servo from anywhere within
    assert ((beyond[0] == ours.high) | (beyond[1] == ours.low)).all()


def test_actions_invert_set_points_within_the_clip() -> None:
    ours = mapping()
    draw = torch.Generator().manual_seed(1)
    wanted = LOW + (HIGH - LOW) * torch.rand(64, 28, generator=draw, dtype=torch.float64)
    torch.testing.assert_close(ours.set_points(ours.actions(wanted)), wanted)
    assert ours.actions(wanted + 100.0).max() == WORLD.action_clip


def test_both_precisions_agree() -> None:
    draw = torch.Generator().manual_seed(2)
    action = torch.randn(64, 28, generator=draw)
    torch.testing.assert_close(
        mapping(torch.float32).set_points(action),
        mapping().set_points(action.double()).float(),
        atol=1e-5,
        rtol=0,
    )
