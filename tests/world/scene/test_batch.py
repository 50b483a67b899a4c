"""Many scenes on one batch: actions and targets, what is set down, blow-ups, and exact states."""

import math

import numpy as np
import pytest
import torch

from world.character import model as character
from world.furniture.catalogue import find
from world.scene.batch import Scenes
from world.scene.model import compile_scene


def scenes(n: int = 3) -> Scenes:
    found = Scenes([compile_scene(find("chair-train-000"))] * n, 0.35, 3.0)
    qpos = torch.from_numpy(character.standing_qpos()).repeat(n, 1)
    yaw = torch.tensor([[1.0, 0.0]]).repeat(n, 1)
    origin = torch.tensor([[2.0, 0.0, 0.0]]).repeat(n, 1)
    found.set_state(torch.arange(n), qpos, torch.zeros(n, character.NV), origin, yaw)
    return found


def test_actions_and_targets_are_inverse_within_the_bounds() -> None:
    found = scenes()
    action = torch.randn(3, 28, generator=torch.Generator().manual_seed(0)).clamp(-1, 1) * 0.5
    torch.testing.assert_close(found.actions(found.set_points(action.double())), action.double())
    far = found.set_points(torch.full((3, 28), 99.0, dtype=torch.float64))
    _, high = character.set_point_bounds()
    assert (far <= torch.from_numpy(high)).all()
    neutral = torch.from_numpy(character.neutral_set_points())
    torch.testing.assert_close(
        found.set_points(torch.zeros(3, 28, dtype=torch.float64))[0], neutral
    )


@pytest.mark.parametrize("yaw", [-3.0, -0.4, 0.0, 1.7, math.pi])
def test_furniture_turns_by_its_yaw(yaw: float) -> None:
    found = scenes(1)
    turned = torch.tensor([[math.cos(yaw), math.sin(yaw)]], dtype=torch.float64)
    found.move_furniture(torch.tensor([0]), torch.tensor([[1.0, 2.0, 0.0]]), turned)
    physics = found.physics()
    w, x, y, z = physics["mocap_quat"].reshape(4).tolist()
    assert (x, y) == (0.0, 0.0)
    assert math.remainder(2 * math.atan2(z, w) - yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-7)
    assert physics["mocap_pos"].reshape(3).tolist() == [1.0, 2.0, 0.0]


def test_every_divergence_of_a_scene_is_reported_once_and_the_others_are_sound() -> None:
    found = scenes()
    for scene in (1, 1, 0, 1):
        found.qvel[scene, 6:] = 1e12
        found.act(torch.zeros(3, 28))
        assert found.finite().tolist() == [k != scene for k in range(3)]
        found.set_state(
            torch.tensor([scene]), torch.from_numpy(character.standing_qpos())[None],
            torch.zeros(1, character.NV), torch.tensor([[2.0, 0, 0]]), torch.tensor([[1.0, 0]]),
        )  # fmt: skip
        found.act(torch.zeros(3, 28))
        assert found.finite().all()


def test_a_restored_state_goes_on_to_the_same_bits() -> None:
    found = scenes()
    draw = torch.Generator().manual_seed(3)
    actions = 0.3 * torch.randn(6, 3, 28, generator=draw)
    for action in actions[:3]:
        found.act(action)
    kept = found.physics()
    for action in actions[3:]:
        found.act(action)
    wanted = found.physics()
    other = scenes()
    other.load_physics(kept)
    for action in actions[3:]:
        other.act(action)
    for name, value in other.physics().items():
        np.testing.assert_array_equal(value, wanted[name], err_msg=name)


def test_bodies_of_some_scenes_are_those_of_all() -> None:
    found = scenes()
    found.qpos[2, 0] = 5.0
    some, every = found.body(torch.tensor([2, 0])), found.body()
    torch.testing.assert_close(some.features, every.features[[2, 0]])
    torch.testing.assert_close(some.position, every.position[[2, 0]])
