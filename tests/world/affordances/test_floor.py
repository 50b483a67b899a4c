"""A point of the floor: it needs no furniture, and its trials have a marker."""

import numpy as np
import pytest
import torch

from world.affordances import FLOOR
from world.affordances.affordance import Setting
from world.config import WorldConfig
from world.errors import ConfigError
from world.objects.floor_bank import MARKER
from world.scene import perturbations
from world.scene.batch import Scenes

WALK = WorldConfig(task="walk")


def test_furniture_is_refused() -> None:
    assert FLOOR.pieces(WALK) == ((), "")
    assert FLOOR.trial_pieces("test", 3, 0, WALK) == (MARKER,)
    assert FLOOR.choices("test") == {MARKER.name: MARKER}
    assert FLOOR.sized(MARKER, 0.5) is MARKER and FLOOR.use_point_count(MARKER) == 1
    with pytest.raises(ConfigError, match="this task needs no furniture"):
        FLOOR.pieces(WorldConfig(objects=("train",)))
    with pytest.raises(ConfigError, match="this task needs no furniture"):
        FLOOR.trial_pieces("train", 3, 0, WALK)


def test_the_marker_goes_where_the_target_is() -> None:
    point = torch.tensor([[2.0, 0.0], [0.0, -3.0]])
    facing = torch.tensor([[1.0, 0.0], [0.0, 1.0]])
    nothing = perturbations.draw("none", 2, 0, 60)
    setting = Setting((MARKER,) * 2, nothing, point, facing, np.arange(2), 0, (1.0, 2.0))
    floor = FLOOR.arrange(setting)
    scenes = Scenes(floor.models, 0.35, 3.0)
    target = floor.begin(scenes)
    torch.testing.assert_close(target.point[:, :2], point)
    where = scenes.physics()["mocap_pos"][:, 0]
    torch.testing.assert_close(where[:, :2].float(), point)
    second, there = torch.tensor([1]), torch.tensor([[4.0, 4.0]])
    moved = floor.move(scenes, second, there, facing[:1])
    assert torch.equal(moved.point[:, :2], there) and torch.equal(moved.facing, facing[:1])
    where = scenes.physics()["mocap_pos"][:, 0, :2].float()
    torch.testing.assert_close(where, torch.cat((point[:1], there)))
