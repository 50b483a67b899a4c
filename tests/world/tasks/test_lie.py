"""The lie task: goal, way round the furniture, reward, stages and starts by hand."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch

from world.character import features
from world.character import model as character
from world.config import InitialStates, WorldConfig
from world.episodes.shard import Shard
from world.errors import PieceError
from world.furniture.catalogue import catalogue, find
from world.furniture.usage import use_points
from world.initial.furniture import FurnitureSampler
from world.motions.library import MotionLibrary, StyleMixture, StyleSource
from world.motions.synthetic.library import walking
from world.motions.synthetic.lies import lying
from world.motions.uses.bed import BED
from world.objects.furniture_bank import FurnitureBank, variants
from world.tasks import HELD, Target, make, state
from world.tasks.lie import HEAD_ABOVE_M, HIP_ABOVE_M, Lie
from world.tasks.route import footprint, way

#: From the root to the head's centre, straightened out (humanoid.xml).
REACH_M = 0.236151 + 0.223894 + 0.175


def bed(yaw: float = 0.0, height: float = 0.45) -> Target:
    """2.0 x 1.2 m; got onto at its front (+x of the place), the head to the left (+y)."""
    corners = torch.tensor(
        [[x, y, z] for x in (-0.7, 0.5) for y in (-1.2, 0.8) for z in (0.0, 0.9)]
    )
    c, s = math.cos(yaw), math.sin(yaw)
    turn = torch.tensor([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return Target(
        torch.tensor([[0.0, 0.0, height]]),
        torch.tensor([[c, s]]),
        (corners @ turn.T)[None],
        (torch.tensor([[0.0, REACH_M, height]]) @ turn.T),
    )


def standing(x: float, y: float, velocity: tuple[float, ...] = (0, 0, 0)) -> features.Body:
    qpos = torch.from_numpy(character.standing_qpos()).float()[None].clone()
    qpos[0, :2] = torch.tensor([x, y])
    qvel = torch.zeros(1, character.NV)
    qvel[0, :3] = torch.tensor(velocity)
    return features.body(qpos, qvel)


def on_the_back(height: float = 0.45) -> features.Body:
    """Straight on the back, the head to +y, the chest up: x forward becomes up, z becomes +y."""
    qpos = torch.from_numpy(character.standing_qpos()).float()[None].clone()
    qpos[0, :3] = torch.tensor([0.0, 0.0, height + HIP_ABOVE_M])
    qpos[0, 3:7] = torch.tensor([0.5, -0.5, -0.5, -0.5])
    for address in character.BALL_QPOS:
        qpos[0, address : address + 4] = torch.tensor([1.0, 0.0, 0.0, 0.0])
    return features.body(qpos, torch.zeros(1, character.NV))


def terms(body: features.Body, where: Target) -> dict[str, float]:
    return dict(zip(Lie.terms, Lie().reward_terms(body, where)[0].tolist(), strict=True))


def test_the_head_is_where_the_model_has_it() -> None:
    body = on_the_back()
    torch.testing.assert_close(body.head - body.root, torch.tensor([[0.0, REACH_M, 0.0]]))


def test_goal() -> None:
    assert make("lie").goal.width == 32
    goal = Lie().goal_features(standing(-1.0, 0.0), bed())[0]
    root = character.standing_qpos()[2]
    up = 0.45 + HIP_ABOVE_M - root
    torch.testing.assert_close(goal[:3], torch.tensor([1.0, 0.0, up], dtype=torch.float32))
    torch.testing.assert_close(goal[3:6], torch.tensor([0.0, REACH_M, HEAD_ABOVE_M - HIP_ABOVE_M]))
    torch.testing.assert_close(goal[6:8], torch.tensor([1.0, 0.0]))
    torch.testing.assert_close(goal[8:11], torch.tensor([-0.7, -1.2, -0.45 - HIP_ABOVE_M]))


def test_lying_is_worth_all_and_standing_before_the_bed_little() -> None:
    found = terms(on_the_back(), bed())
    sag = HEAD_ABOVE_M - HIP_ABOVE_M
    head = 0.5 * math.exp(-10 * sag**2) + 0.5 * math.exp(-2 * sag**2)
    assert found["lie"] == pytest.approx(0.4 + 0.6 * head, abs=1e-4)
    assert found["approach"] == pytest.approx(1.0, abs=1e-4)
    tilt = math.atan(sag / REACH_M)
    assert found["posture"] == pytest.approx(1.0 - tilt / math.pi, abs=1e-3)

    def reward(body: features.Body) -> float:
        return sum(Lie.terms[name] * value for name, value in terms(body, bed()).items())

    edge, far = reward(standing(0.8, 0.0)), reward(standing(3.0, 0.0))
    walking = reward(standing(3.0, 0.0, (-1.0, 0.0, 0.0)))
    assert far < walking < 0.5
    assert edge < 0.4 < 0.95 < reward(on_the_back())


def test_leaning_back_from_sitting_at_the_edge_pays_all_the_way() -> None:
    """Upright on the edge, then leaning to the head's side degree by degree about the hip."""
    where, rewards = bed(), []
    for lean in torch.arange(0.0, 91.0, 10.0) * math.pi / 180:
        lying = on_the_back()
        position = lying.position + torch.tensor([0.3, 0.0, 0.0])
        along = torch.tensor([[0.0, math.sin(lean), math.cos(lean)]]) * REACH_M
        head = position[:, 0] + along
        body = replace(lying, position=position, head=head, heading=where.facing)
        rewards.append(terms(body, where))
    total = [sum(Lie.terms[name] * value for name, value in found.items()) for found in rewards]
    steps = [after - before for before, after in pairwise(total)]
    assert min(steps) > 0.012, "no flat stretch on the way down"
    assert total[0] < 0.5 < 0.7 < total[-1]


def upright(x: float, height: float) -> features.Body:
    """Sitting upright on a surface, facing +x, the hip at x."""
    body = on_the_back(height)
    position = body.position + torch.tensor([x, 0.0, 0.0])
    head = position[:, 0] + torch.tensor([[0.0, 0.0, REACH_M]])
    return replace(body, position=position, head=head, heading=torch.tensor([[1.0, 0.0]]))


@pytest.mark.parametrize("height", [0.45, 0.60, 0.76])
@pytest.mark.parametrize("half_depth_m", [0.0, 0.6])
def test_every_step_from_the_edge_to_lying_pays(height: float, half_depth_m: float) -> None:
    """Also onto a table as high as the hip, and onto a bed whose place is a metre from its edge:
    where sitting on the edge paid no more than standing at it, it stood."""
    where = bed(height=height)
    where = replace(where, corners=where.corners + torch.tensor([half_depth_m, 0.0, 0.0]))
    on_the_way = [
        standing(0.5 + half_depth_m + 0.32, 0.0),
        upright(0.5 + half_depth_m - 0.15, height),
        upright(0.15, height),
        on_the_back(height),
    ]
    pay = [sum(Lie.terms[k] * v for k, v in terms(b, where).items()) for b in on_the_way]
    assert min(after - before for before, after in pairwise(pay)) > 0.015, pay


def test_error_is_the_worse_of_hip_and_head() -> None:
    task = Lie()
    sag = HEAD_ABOVE_M - HIP_ABOVE_M
    assert task.error_m(on_the_back(), bed()).item() == pytest.approx(sag, abs=1e-5)
    # turned end for end the hip is right and the head 1.27 m off
    where = bed()
    assert where.head is not None
    turned = Target(where.point, where.facing, where.corners, where.head * torch.tensor([1, -1, 1]))
    error = task.error_m(on_the_back(), turned).item()
    assert error == pytest.approx(math.hypot(2 * REACH_M, sag), abs=1e-4)


def test_stages() -> None:
    task = Lie()
    assert task.stages == ("approached", "touched", "lain")
    assert task.stage(standing(3.0, 0.0), bed())[0].tolist() == [False, False, False]
    assert task.stage(standing(0.8, 0.0), bed())[0].tolist() == [True, False, False]
    assert task.stage(on_the_back(), bed())[0].tolist() == [True, True, True]
    # at the foot end one has not arrived: the bed is got onto by its front
    assert not task.stage(standing(0.0, -1.6), bed())[0, 0]


def test_one_may_be_low_on_the_bed_alone() -> None:
    task = Lie()
    assert task.low(standing(0.8, 0.0), bed()).item()
    assert task.low(on_the_back(), bed()).item()
    assert not task.low(standing(1.0, 0.0), bed()).item()
    assert not task.fell(on_the_back(), bed()).item()
    assert task.fell(on_the_back(0.02), bed(height=0.02)).item()


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_the_way_leads_round_the_bed(yaw: float) -> None:
    where = bed(yaw)
    c, s = math.cos(yaw), math.sin(yaw)
    ground = footprint(where)
    torch.testing.assert_close(ground.low, torch.tensor([[-0.7, -1.2]]), atol=1e-5, rtol=0)
    torch.testing.assert_close(ground.high, torch.tensor([[0.5, 0.8]]), atol=1e-5, rtol=0)
    angle = torch.arange(0, 360, 20) * math.pi / 180
    turn = torch.tensor([[c, s], [-s, c]])
    xy = 3.0 * torch.stack((angle.cos(), angle.sin()), dim=1) @ turn
    many = where.rows(torch.zeros(len(xy), dtype=torch.int64))
    direction = -xy / xy.norm(dim=1, keepdim=True)
    _, expected = way(xy, direction, many)
    walked, there = torch.zeros(len(xy)), torch.zeros(len(xy), dtype=torch.bool)
    for _ in range(400):
        direction, left = way(xy, direction, many)
        there |= left < 0.05
        assert ((direction.norm(dim=1) - 1.0).abs() < 1e-4)[~there].all()
        xy = torch.where(there[:, None], xy, xy + 0.02 * direction)
        walked += 0.02 * ~there
        assert not footprint(many).holds(xy @ turn.T, 0.12).any()
        if there.all():
            break
    assert there.all()
    # the length it tells is that walked, but for the corner that is cut at the front
    assert ((0.9 * expected - 0.05 < walked) & (walked < expected + 0.05)).all()


def test_where_pieces_are_got_onto() -> None:
    sofa = use_points(find("sofa-train-000"), "lie")
    assert [round(spot.facing_rad, 6) for spot in sofa] == [0.0]
    sides = [spot.facing_rad for spot in use_points(find("bed-train-000"), "lie")]
    assert len(sides) in (1, 2)
    assert all(abs(abs(side) - math.pi / 2) < 1e-6 for side in sides)
    # a single bed from both sides, a double bed from that of its sleeper
    single, double = find("bed-train-003"), find("bed-train-000")
    assert single.lie is not None and abs(single.lie.hip_m[1]) < 1e-6
    assert len(use_points(single, "lie")) == 2
    assert double.lie is not None and double.lie.hip_m[1] > 0.3
    assert [spot.facing_rad for spot in use_points(double, "lie")] == [pytest.approx(math.pi / 2)]
    with pytest.raises(PieceError, match="chair-train-000: has no place to lie"):
        use_points(find("chair-train-000"), "lie")
    with pytest.raises(PieceError, match="has no place to lie"):
        FurnitureBank([find("chair-train-000")], "lie")


@pytest.fixture(scope="module")
def bank() -> FurnitureBank:
    return FurnitureBank(variants(catalogue("train", 8, affordance="lie"), 4, (0.8, 1.2)), "lie")


@pytest.fixture(scope="module")
def library() -> MotionLibrary:
    generator = np.random.default_rng(0)
    beds = [lying(generator, 0.45, 1.5, 0.3, 1, left) for left in (True, False)]
    return MotionLibrary([*beds, walking(generator, 1.0)], use=BED)


def test_places_turn_with_the_pieces(bank: FurnitureBank) -> None:
    n = len(bank)
    every = torch.arange(n)
    angle = torch.linspace(0.0, 6.0, n)
    facing = torch.stack((angle.cos(), angle.sin()), dim=1)
    place = bank.target(every, torch.full((n, 2), 3.0), facing)
    assert place.head is not None
    along = place.head - place.point
    torch.testing.assert_close(along.norm(dim=1), (bank.head - bank.point).norm(dim=1))
    # got onto from the side: square to the line from hip to head
    assert (along[:, :2] * facing).sum(dim=1).abs().max() < 1e-3
    ground = footprint(place)
    torch.testing.assert_close(ground.low, bank.low, atol=1e-4, rtol=0)
    torch.testing.assert_close(ground.high, bank.high, atol=1e-4, rtol=0)


def test_standing_starts_are_clear_of_the_bed(library: MotionLibrary, bank: FurnitureBank) -> None:
    n = 1024
    config = WorldConfig(task="lie", initial=InitialStates(0, 1, 1))
    starts = FurnitureSampler(config, library, bank, 0).draw(torch.arange(n), torch.ones(n).long())
    outside = bank.beyond(starts.variant, torch.zeros(n, 2), starts.point, starts.facing)
    # those before it stand at 0.4 m and more from the edge, aslant by up to 60 degrees: 0.2 m
    assert outside.min() > 0.19
    assert outside[starts.kind == 2].min() > 0.349
    assert starts.point.norm(dim=1).max() <= 10.0 + 1e-4


def test_reference_states_lie_at_the_height_of_the_bed(
    library: MotionLibrary, bank: FurnitureBank
) -> None:
    n = 256
    config = WorldConfig(task="lie", initial=InitialStates(1, 0, 0, reference_stages=(0, 0, 1)))
    starts = FurnitureSampler(config, library, bank, 0).draw(torch.arange(n), torch.ones(n).long())
    body = features.body(starts.qpos, starts.qvel)
    place = bank.target(starts.variant, starts.point, starts.facing)
    assert place.head is not None
    outside = bank.beyond(starts.variant, torch.zeros(n, 2), starts.point, starts.facing)
    assert (outside < 0).all()
    above = body.root[:, 2] - place.point[:, 2]
    assert (above - HIP_ABOVE_M).abs().quantile(0.9) < 0.13
    # the head is at the head's end, also where the clip is mirrored
    towards = ((place.head - place.point) * (body.head - body.root)).sum(dim=1)
    assert (towards > 0).all()
    assert Lie().stage(body, place)[:, 1].float().mean() > 0.95


def test_style_sees_higher_beds_too(library: MotionLibrary) -> None:
    raised = StyleMixture(locomotion=0.0, approach=0.0, transition=0.0, raised_m=(0.3, 0.3))
    own = StyleMixture(locomotion=0.0, approach=0.0, transition=0.0, raised_m=(0.0, 0.0))
    (high, high_next), (low, _) = (StyleSource(library, 0, m).sample(64, 3) for m in (raised, own))
    object_z = features.STATE.slice("object_position").start + 2
    torch.testing.assert_close(high[:, 0] - low[:, 0], torch.full((64,), 0.3))
    torch.testing.assert_close(high[:, object_z] - low[:, object_z], torch.full((64,), -0.3))
    # both frames of a transition are raised alike
    assert (high_next[:, 0] - high[:, 0]).abs().max() < 0.05


def test_the_shard_runs_and_tells_its_stages(library: MotionLibrary, bank: FurnitureBank) -> None:
    config = WorldConfig(task="lie", initial=InitialStates(1, 1, 1))
    shard = Shard(config, library, bank, range(32), 0)
    ended = 0
    for _ in range(40):
        step = shard.step(torch.zeros(32, 28))
        assert step.finite.all()
        names = [name for name in step.episodes if name.startswith("stage_")]
        assert names == [f"stage_{name}" for name in (*Lie.stages, HELD)]
        ended += len(step.end_ids)
    assert ended > 5
    seen, goal = shard.observe()
    assert seen.shape == (32, 114)
    assert goal.shape == (32, Lie.goal.width)
    assert torch.equal(seen, state(shard._scenes.body(), shard._target()))


def corner_sofa(yaw: float = 0.0) -> Target:
    """The sofa is 0.3 m deep before the hip; on the right a chaise reaches to 1.0 m."""
    straight = torch.tensor(
        [[x, y, z] for x in (-0.4, 0.3) for y in (-0.9, 0.9) for z in (0.0, 0.8)]
    )
    straight[4:6, 0] = 1.0
    c, s = math.cos(yaw), math.sin(yaw)
    turn = torch.tensor([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return Target(
        torch.tensor([[0.0, 0.0, 0.42]]),
        torch.tensor([[c, s]]),
        (straight @ turn.T)[None],
        (torch.tensor([[0.0, REACH_M, 0.42]]) @ turn.T),
    )


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_the_way_onto_an_l_shaped_sofa_is_through_its_notch(yaw: float) -> None:
    """The mouth is at (1.32, 0.3), the entry at (0.62, 0.3)."""
    place = corner_sofa(yaw)
    c, s = math.cos(yaw), math.sin(yaw)
    turn = torch.tensor([[c, -s], [s, c]])

    def led(x: float, y: float) -> tuple[torch.Tensor, float]:
        here = torch.tensor([[x, y]]) @ turn.T
        direction, length = way(here, torch.tensor([[1.0, 0.0]]) @ turn.T, place)
        return direction[0] @ turn, float(length)

    mouth, entry = torch.tensor([1.32, 0.3]), torch.tensor([0.62, 0.3])
    # from the front on the chaise's side: to the mouth first
    here = torch.tensor([2.5, -0.5])
    direction, length = led(2.5, -0.5)
    torch.testing.assert_close(direction, (mouth - here) / (mouth - here).norm())
    assert length == pytest.approx(float((mouth - here).norm()) + 0.7, abs=1e-5)
    # at the mouth and in the notch: straight in
    for x, y in ((1.3, 0.4), (0.9, 0.2)):
        direction, length = led(x, y)
        straight = entry - torch.tensor([x, y])
        torch.testing.assert_close(direction, straight / straight.norm())
        assert length == pytest.approx(float(straight.norm()), abs=1e-5)
    # at the chaise's end one is not there yet; in the notch one is
    task = Lie()
    for x, y, there in (
        (1.32, -0.5, False),
        (0.8, -0.5, False),
        (0.7, 0.3, True),
        (0.1, 0.0, True),
    ):
        xy = (torch.tensor([[x, y]]) @ turn.T)[0]
        found = task.stage(standing(float(xy[0]), float(xy[1])), place)[0, 0]
        assert bool(found) is there, (x, y)
