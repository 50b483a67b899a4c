"""Walk: its goal, its reward by hand, when it is done, and an episode of it."""

import math

import pytest
import torch

from world.character import features, servos
from world.character import model as character
from world.character.features import Body
from world.config import InitialStates, WorldConfig
from world.episodes.shard import Shard
from world.motions import load
from world.motions.library import MotionLibrary
from world.motions.uses.floor import FLOOR
from world.objects.floor_bank import FloorBank
from world.scene.batch import Scenes
from world.scene.target import Target, state
from world.tasks.walk import Walk

TASK = Walk()


@pytest.fixture(scope="module")
def library() -> MotionLibrary:
    clips = load.own_clips()
    wanted = ("walk_1.0", "stop_0.8", "turn_90")
    return MotionLibrary(
        [clip for clip in clips if clip.name in wanted or clip.seat is not None][:6], use=FLOOR
    )


def standing(
    x: float = 0.0, yaw: float = 0.0, speed: float = 0.0, height: float | None = None
) -> Body:
    """A character that stands at x, faces yaw, and moves along x; height: of its root, m."""
    qpos = torch.from_numpy(character.standing_qpos()).float()[None]
    qpos[0, 2] = qpos[0, 2] if height is None else height
    qpos[0, 0] = x
    qpos[0, 3], qpos[0, 6] = math.cos(yaw / 2), math.sin(yaw / 2)
    qvel = torch.zeros(1, character.NV)
    qvel[0, 0] = speed
    return features.body(qpos, qvel)


def target(x: float, y: float = 0.0, yaw: float = 0.0) -> Target:
    facing = torch.tensor([[math.cos(yaw), math.sin(yaw)]])
    return FloorBank.target(torch.tensor([[x, y]]), facing)


def terms(body: Body, where: Target) -> dict[str, float]:
    values = TASK.reward_terms(body, where)[0].tolist()
    return dict(zip(TASK.terms, values, strict=True))


def test_goal_and_state_are_seen_from_the_heading() -> None:
    body, where = standing(yaw=math.pi / 2), target(1.0, 0.0, math.pi)
    goal = TASK.goal_features(body, where)[0]
    torch.testing.assert_close(goal, torch.tensor([0.0, -1.0, 0.0, 0.0, 1.0]), atol=1e-5, rtol=0)
    around = state(body, where)[0, features.OBJECT]
    height = float(body.root[0, 2])
    wanted = torch.tensor([0.0, -1.0, -height, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    torch.testing.assert_close(around, wanted, atol=1e-5, rtol=0)
    far = TASK.goal_features(standing(), target(6.0))[0, 0]
    assert float(far) == pytest.approx(1.5 * (1 + math.log(4.0)), abs=1e-5)


def test_terms_by_hand() -> None:
    there = terms(standing(), target(0.0))
    assert there == pytest.approx(
        {"stand": 1, "approach": 1, "facing": 1, "upright": 1, "overspeed": 0}, abs=1e-5
    )
    away = terms(standing(), target(2.0))
    assert away["approach"] == 0.0 and away["facing"] == pytest.approx(1.0, abs=1e-3)
    assert away["stand"] < 1e-9
    walking = terms(standing(speed=0.45), target(2.0, yaw=math.pi))
    assert walking["approach"] == pytest.approx(0.5, abs=1e-5)
    assert walking["facing"] == pytest.approx(1.0, abs=1e-3)  # on the way, along the way
    turned = terms(standing(), target(0.0, yaw=math.pi / 2))
    assert turned["facing"] == pytest.approx(0.5, abs=1e-5)
    passing = terms(standing(speed=1.0), target(0.0))
    assert passing["stand"] == pytest.approx(0.6 + 0.4 * math.exp(-8.0), abs=1e-5)
    assert passing["overspeed"] == 0.0
    bent = [terms(standing(height=z), target(0.0))["upright"] for z in (0.65, 0.765, 0.9)]
    assert bent == pytest.approx([0.0, 0.5, 1.0], abs=1e-5)
    assert terms(standing(speed=1.8), target(4.0))["overspeed"] == pytest.approx(-0.5, abs=1e-5)
    assert terms(standing(speed=1.8), target(0.5))["overspeed"] == pytest.approx(-0.5, abs=1e-5)


@pytest.mark.parametrize(
    ("body", "where", "error"),
    [
        (standing(), target(0.15), 0.15),
        (standing(), target(0.0, yaw=math.radians(20.0)), 0.2),
        (standing(), target(0.0, yaw=math.radians(90.0)), 0.9),
        (standing(speed=0.2), target(0.0), 0.1),
        (standing(speed=1.0), target(0.0), 0.5),
    ],
)
def test_success_needs_place_facing_and_stillness(body: Body, where: Target, error: float) -> None:
    assert float(TASK.error_m(body, where)[0]) == pytest.approx(error, abs=1e-4)


def test_stages_come_in_order() -> None:
    def stages(where: Target) -> list[bool]:
        return TASK.stage(standing(), where)[0].tolist()

    assert stages(target(1.0)) == [False, False, False]
    assert stages(target(0.3)) == [True, False, False]
    assert stages(target(0.1, yaw=1.0)) == [True, True, False]
    assert stages(target(0.1, yaw=0.3)) == [True, True, True]


def test_an_episode_that_succeeds(library: MotionLibrary) -> None:
    """Standing still at the target: where the facing fits it is held, and ends the episode."""
    config = WorldConfig(
        task="walk",
        initial=InitialStates(
            0.0, 1.0, 0.0, near_m=(0.1, 0.1), front_fraction=1.0, standing_fraction=1.0
        ),
        hold_s=0.2,
    )
    shard = Shard(config, library, FloorBank(), range(64), 0)
    stance = servos.coordinates(torch.from_numpy(character.standing_qpos()).float()[None])
    scenes = Scenes(FloorBank().models, config.action_scale, config.action_clip)
    action = scenes.actions(stance.double()).float().expand(64, -1)
    successes = 0.0
    for _ in range(6):
        step = shard.step(action)
        assert bool(step.finite.all()) and not bool(step.fell.any())
        successes += float(step.episodes["success"].sum())
    # a third of the facings are within 20 degrees of the heading
    assert 12 <= successes <= 32
