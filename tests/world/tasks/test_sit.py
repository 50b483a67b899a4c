"""The sit task: goal, approach, reward and success by hand."""

import math

import pytest
import torch

from world.character import features
from world.character import model as character
from world.tasks import Target, make
from world.tasks.sit import HIP_ABOVE_SEAT_M, Sit, approach, compressed, fallen


def standing(
    x: float,
    y: float,
    z: float = 0.88,
    velocity: tuple[float, ...] = (0, 0, 0),
    yaw: float = 0.0,
) -> features.Body:
    qpos = torch.from_numpy(character.standing_qpos()).float()[None].clone()
    qpos[0, :3] = torch.tensor([x, y, z])
    qpos[0, 3:7] = torch.tensor([math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)])
    qvel = torch.zeros(1, character.NV)
    qvel[0, :3] = torch.tensor(velocity)
    return features.body(qpos, qvel)


def upright(xy: torch.Tensor) -> torch.Tensor:
    """Roots [n, 3] of characters standing at xy [n, 2]."""
    return torch.cat((xy, torch.full_like(xy[:, :1], 0.88)), dim=1)


def place(yaw: float = 0.0, height: float = 0.43) -> Target:
    corners = torch.tensor(
        [[x, y, z] for x in (-0.25, 0.25) for y in (-0.2, 0.2) for z in (0.0, 0.9)]
    )[None]
    facing = torch.tensor([[math.cos(yaw), math.sin(yaw)]])
    return Target(torch.tensor([[0.0, 0.0, height]]), facing, corners)


def terms(body: features.Body, where: Target) -> dict[str, float]:
    task = Sit()
    return dict(zip(task.terms, task.reward_terms(body, where)[0].tolist(), strict=True))


def test_the_registry_has_sit_and_lists_the_choices() -> None:
    assert make("sit").goal.width == 29
    with pytest.raises(Exception, match="unknown task 'fly': choose one of carry, lie, sit"):
        make("fly")


def test_goal() -> None:
    body = standing(-1.0, 0.0)
    goal = Sit().goal_features(body, place(yaw=math.pi / 2))[0]
    # the target is 1 m ahead, 0.43 + 0.075 − 0.88 m up
    torch.testing.assert_close(goal[:3], torch.tensor([1.0, 0.0, 0.43 + HIP_ABOVE_SEAT_M - 0.88]))
    torch.testing.assert_close(goal[3:5], torch.tensor([0.0, 1.0]), atol=1e-6, rtol=0)
    torch.testing.assert_close(goal[5:8], torch.tensor([-0.25, -0.2, -0.43 - HIP_ABOVE_SEAT_M]))


def test_far_targets_are_compressed_near_ones_are_not() -> None:
    near = compressed(torch.tensor([[1.2, -0.5, 0.3]]))
    torch.testing.assert_close(near, torch.tensor([[1.2, -0.5, 0.3]]))
    far = compressed(torch.tensor([[0.0, 10.0, -0.4]]))
    assert far[0, 1].item() == pytest.approx(1.5 * (1 + math.log(10 / 1.5)), rel=1e-5)
    assert far[0, 2].item() == pytest.approx(-0.4)


def test_seated_reward_is_full() -> None:
    found = terms(standing(0.0, 0.0, 0.43 + HIP_ABOVE_SEAT_M), place())
    assert found["sit"] == pytest.approx(1.0, abs=1e-5)
    assert found["approach"] == pytest.approx(1.0, abs=1e-5)
    assert found["facing"] == pytest.approx(1.0)
    assert found["overspeed"] == 0.0


def test_sit_term_by_hand() -> None:
    found = terms(standing(0.3, 0.0, 0.43 + HIP_ABOVE_SEAT_M + 0.1), place())
    expected = 0.5 * math.exp(-10 * (0.3**2 + 0.1**2)) + 0.5 * math.exp(-40 * (0.3**2 + 0.1**2))
    assert found["sit"] == pytest.approx(expected, rel=1e-4)


def test_approach_speed() -> None:
    # 3 m in front of the place, which faces it: straight towards it is −x
    for speed, expected in ((1.2, 1.0), (0.9, 1.0), (0.45, 0.5), (0.0, 0.0), (-0.5, 0.0)):
        body = standing(3.0, 0.0, velocity=(-speed, 0, 0))
        assert terms(body, place())["approach"] == pytest.approx(expected, rel=1e-4)


def test_overspeed_counts_near_only() -> None:
    fast = (-2.0, 0.0, 0.0)
    assert terms(standing(1.0, 0.0, velocity=fast), place())["overspeed"] == pytest.approx(-0.7)
    assert terms(standing(3.0, 0.0, velocity=fast), place())["overspeed"] == 0.0


def test_approach_leads_round_the_back() -> None:
    """From behind, walking along the field reaches the front without crossing the furniture."""
    where = place()
    for start in ((-3.0, 0.3), (-3.0, -0.3), (-1.0, 0.01), (0.2, 1.5), (-0.4, -0.7)):
        xy = torch.tensor([start])
        closest, direction = math.inf, torch.tensor([[1.0, 0.0]])
        for _ in range(400):
            direction, arrived = approach(upright(xy), direction, where)
            if bool(arrived):
                break
            assert direction.norm().item() == pytest.approx(1.0, abs=1e-5)
            xy = xy + 0.02 * direction
            closest = min(closest, xy.norm().item())
        assert bool(arrived), start
        assert closest > 0.45, (start, closest)
        assert xy[0, 0] > 0.0


def test_behind_the_place_the_heading_decides_on_the_side() -> None:
    headings = torch.tensor([[0.8, 0.6], [0.8, -0.6]])
    for y, sides in ((0.3, [1.0, -1.0]), (-0.3, [1.0, -1.0]), (0.5, [1.0, 1.0]), (-0.5, [-1, -1])):
        where = place().rows(torch.zeros(2, dtype=torch.int64))
        roots = upright(torch.tensor([[-1.0, y]]).expand(2, 2))
        direction, _ = approach(roots, headings, where)
        # the tangents to the disc of 0.55 m: by the angle asin(0.55 / distance) off the centre
        centre = math.atan2(-y, 1.0)
        for found, side in zip(direction.tolist(), sides, strict=True):
            angle = centre + side * math.asin(0.55 / math.hypot(1.0, y))
            assert found == pytest.approx([math.cos(angle), math.sin(angle)], abs=1e-5)


def test_leaning_on_the_back_or_an_arm_or_standing_behind_is_no_arrival() -> None:
    seated = 0.43 + HIP_ABOVE_SEAT_M
    for x, y, height, arrived in (
        (-0.28, 0.0, None, 0.0),
        (-0.28, 0.0, seated, 0.0),
        (-0.05, 0.28, None, 0.0),
        (0.1, 0.32, None, 0.0),  # beside a stool
        (-0.05, 0.0, None, 0.0),  # behind or over it, not down
        (-0.05, 0.0, seated, 1.0),
        (-0.05, 0.0, seated + 0.11, 1.0),
        (-0.05, 0.0, seated + 0.13, 0.0),
        (0.05, 0.0, None, 1.0),
        (0.3, 0.0, None, 1.0),
    ):
        body = standing(x, y) if height is None else standing(x, y, height)
        found = terms(body, place())
        error = (Sit().hip(place()) - body.root).square().sum().item()
        expected = arrived * (0.3 + 0.7 * math.exp(-2.5 * error))
        assert found["approach"] == pytest.approx(expected, abs=1e-5), (x, y, height)
        assert bool(Sit().stage(body, place())[0, 0]) == bool(arrived)


def test_approach_turns_with_the_place() -> None:
    yaw = 1.3
    turn = torch.tensor([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    xy = torch.tensor([[-2.0, 0.5]])
    heading = torch.tensor([[0.6, 0.8]])
    straight, _ = approach(upright(xy), heading, place())
    turned, _ = approach(upright(xy @ turn.T), heading @ turn.T, place(yaw))
    torch.testing.assert_close(turned, straight @ turn.T, atol=1e-5, rtol=0)


def test_error_and_fall() -> None:
    task = Sit()
    body = standing(0.15, 0.0, 0.43 + HIP_ABOVE_SEAT_M)
    assert task.error_m(body, place()).item() == pytest.approx(0.15, rel=1e-5)
    assert not fallen(standing(2, 2)).item()
    assert fallen(standing(2, 2, 0.19)).item()  # the pelvis itself
    assert fallen(standing(2, 2, 0.55)).item()  # the knees, 0.42 below


def test_standing_before_the_seat_is_worth_less_than_walking_there() -> None:
    where = place()
    weights = Sit.terms

    def reward(body: features.Body) -> float:
        return sum(weights[name] * value for name, value in terms(body, where).items())

    turned = standing(0.5, 0.0)
    walking = standing(3.0, 0.0, velocity=(-1.0, 0.0, 0.0))
    seated = standing(0.0, 0.0, 0.43 + HIP_ABOVE_SEAT_M)
    idle = standing(3.0, 0.0)
    # (0.3 + 0.7 exp(−2.5 · 0.398)) · 0.3 + (exp(−3.98) + exp(−15.9)) / 2 · 0.5 + 0.2
    assert reward(turned) == pytest.approx(0.3723, abs=1e-3)
    assert reward(seated) == pytest.approx(1.0, abs=1e-4)
    # it walks backwards here: no reward for facing
    assert reward(walking) == pytest.approx(0.3, abs=1e-4)
    assert reward(idle) == pytest.approx(0.0, abs=1e-4)


def test_turning_round_before_the_seat_pays_from_the_first_degree() -> None:
    facing = []
    for degrees in (180.0, 179.0, 90.0, 0.0):
        body = standing(0.5, 0.0, yaw=math.radians(degrees))
        facing.append(terms(body, place())["facing"])
    assert facing == pytest.approx([0.0, 1 / 180, 0.5, 1.0], abs=1e-3)
    # behind the furniture, what counts is the way round it: the tangent to the disc of 0.55 m
    behind = terms(standing(-0.8, 0.0), place())["facing"]
    assert behind == pytest.approx(1 - math.asin(0.55 / 0.8) / math.pi, abs=1e-3)
