"""The carry task: goal, reward and stages by hand."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
import torch
from torch import Tensor

from world.character import features
from world.character import model as character
from world.scene.box import BOX_SIZE_M
from world.scene.target import BoxState
from world.tasks import Target, make, state
from world.tasks.carry import Carry, grips, reach_m


def standing(velocity: tuple[float, ...] = (0, 0, 0), yaw: float = 0.0) -> features.Body:
    qpos = torch.from_numpy(character.standing_qpos()).float()[None].clone()
    qpos[0, 3:7] = torch.tensor([math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)])
    qvel = torch.zeros(1, character.NV)
    qvel[0, :3] = torch.tensor(velocity)
    return features.body(qpos, qvel)


def with_hands(right: tuple[float, ...], left: tuple[float, ...]) -> features.Body:
    """A standing body whose hands are put somewhere."""
    body = standing()
    position = body.position.clone()
    position[0, character.BODIES.index("right_hand")] = torch.tensor(right)
    position[0, character.BODIES.index("left_hand")] = torch.tensor(left)
    return replace(body, position=position)


def a_box(
    at: tuple[float, ...],
    target: tuple[float, ...] = (4.0, 0.0, 0.7),
    start: tuple[float, ...] | None = None,
    velocity: tuple[float, ...] = (0, 0, 0),
    yaw: float = 0.0,
) -> Target:
    found = BoxState(
        position=torch.tensor([at]),
        rotation=torch.tensor([[math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]]),
        velocity=torch.tensor([velocity], dtype=torch.float32),
        half=0.5 * torch.tensor([BOX_SIZE_M]),
        start=torch.tensor([start or at]),
        target=torch.tensor([target]),
    )
    facing = torch.tensor([[math.cos(yaw), math.sin(yaw)]])
    return Target(found.target, facing, found.corners(), found.target, found)


def terms(body: features.Body, where: Target) -> dict[str, float]:
    return dict(zip(Carry.terms, Carry().reward_terms(body, where)[0].tolist(), strict=True))


def test_goal_and_object_features() -> None:
    body = standing(yaw=math.pi / 2)
    where = a_box((0.0, 1.0, 0.7), (0.0, 2.2, 0.7), velocity=(0.0, 0.5, 0.1))
    assert make("carry").goal.width == 46
    goal = Carry().goal_features(body, where)[0]
    root = float(character.standing_qpos()[2])
    # the character looks along +y: what is at +y is ahead
    torch.testing.assert_close(goal[:3], torch.tensor([1.0, 0.0, 0.7 - root]))
    ahead = 1.5 * (1 + math.log(2.2 / 1.5))
    torch.testing.assert_close(goal[3:6], torch.tensor([ahead, 0.0, 0.7 - root]))
    torch.testing.assert_close(goal[6:9], torch.tensor([1.2, 0.0, 0.0]))
    torch.testing.assert_close(goal[19:22], torch.tensor([0.5, 0.0, 0.1]))
    # the box' low x, y, z corner: its x is the character's right
    torch.testing.assert_close(goal[22:25], torch.tensor([-0.25, 0.175, -0.15]))
    seen = state(body, where)[0, features.OBJECT]
    torch.testing.assert_close(seen[:3], torch.tensor([1.0, 0.0, 0.7 - root]))
    torch.testing.assert_close(seen[3:], torch.tensor([0.0, -1.0, 0.0, 0.0, 0.0, 1.0]))


def test_what_is_near_is_observed_finely() -> None:
    """Offsets d · exp(-(|d| / 0.5 m)²), of box and target level; worked out by hand."""
    where = a_box((0.3, 0.0, 1.0), (0.5, 0.1, 1.3))
    # the left hand touches its face; the right one is 4 cm off, below and behind it
    hands = with_hands((0.1, -0.29, 0.8), (0.3, 0.25, 1.0))
    table, goal = Carry.goal, Carry().goal_features(hands, where)[0]

    def of(name: str) -> Tensor:
        return goal[table.slice(name)]

    torch.testing.assert_close(of("near_box"), torch.tensor([0.3 * math.exp(-0.36), 0.0]))
    far = math.exp(-0.05 / 0.25)
    torch.testing.assert_close(of("near_way"), torch.tensor([0.2 * far, 0.1 * far]))
    # the box is 0.35 m long, 0.5 m wide and 0.3 m high
    gap = torch.tensor([0.025, 0.04, 0.05])
    faded = gap * math.exp(-float(gap.square().sum()) / 0.25)
    torch.testing.assert_close(of("near_right_hand"), faded)
    torch.testing.assert_close(of("near_left_hand"), torch.zeros(3), atol=1e-6, rtol=0)
    # a hand in the box is at it, and what is far away is not seen
    inside = with_hands((0.3, 0.0, 1.0), (0.3, 0.25, 1.0))
    found = Carry().goal_features(inside, a_box((0.3, 0.0, 1.0), (9.0, 0.0, 1.0)))[0]
    assert not found[table.slice("near_right_hand")].any()
    assert found[table.slice("near_way")].abs().max() < 1e-30


def test_an_upright_box_looks_like_furniture() -> None:
    where = a_box((1.0, -2.0, 0.6), yaw=1.1)
    body = standing(yaw=0.4)
    assert where.box is not None
    upright = features.object_features(body.root, body.heading, where.box.position, where.facing)
    posed = features.posed_object_features(
        body.root, body.heading, where.box.position, where.box.rotation
    )
    torch.testing.assert_close(posed, upright, atol=1e-6, rtol=0)


def test_hands_hold_by_two_opposite_faces() -> None:
    where = a_box((0.4, 0.0, 1.0))
    assert where.box is not None
    across = with_hands((0.4, -0.29, 1.0), (0.4, 0.29, 1.0))
    torch.testing.assert_close(reach_m(across, where.box), torch.zeros(1, 2), atol=1e-6, rtol=0)
    assert grips(across, where.box).item()
    # the short way, and with the box turned by 90 degrees, the same
    along = with_hands((0.185, 0.0, 1.0), (0.615, 0.0, 1.0))
    turned = a_box((0.4, 0.0, 1.0), yaw=math.pi / 2)
    assert turned.box is not None
    for body, held in ((along, where.box), (across, turned.box)):
        assert grips(body, held).item() == (held is where.box)
    # both hands on one face hold nothing, nor does a hand 7 cm off
    one_face = with_hands((0.3, -0.29, 1.0), (0.5, -0.29, 1.0))
    assert not grips(one_face, where.box).item()
    assert not grips(with_hands((0.4, -0.36, 1.0), (0.4, 0.29, 1.0)), where.box).item()
    assert reach_m(with_hands((0.4, -0.36, 1.0), (0.4, 0.29, 1.0)), where.box)[
        0, 0
    ].item() == pytest.approx(0.07, abs=1e-6)


def test_a_deep_box_may_be_held_before_its_middle() -> None:
    """By hand: the short faces, axis x, are 0.5 m deep: from the centre to 0.175 m from an edge are
    0.075 m. The long ones, 0.35 m deep, are held at their centres."""
    where = a_box((0.4, 0.0, 1.0), yaw=math.pi / 2)
    assert where.box is not None
    # turned by 90 degrees its depth, axis y, is along the world's −x; its faces x are at y ± 0.175
    for ahead, expected in ((0.4, 0.0), (0.34, 0.0), (0.3, 0.025), (0.5, 0.025)):
        body = with_hands((ahead, -0.215, 1.0), (ahead, 0.215, 1.0))
        torch.testing.assert_close(
            reach_m(body, where.box), torch.full((1, 2), expected), atol=1e-5, rtol=0
        )
    across = with_hands((0.34, -0.29, 1.0), (0.34, 0.29, 1.0))
    straight = a_box((0.4, 0.0, 1.0)).box
    assert straight is not None
    assert reach_m(across, straight).amax().item() == pytest.approx(0.06, abs=1e-5)


def test_reward_of_walking_to_the_box() -> None:
    for speed, expected in ((0.9, 0.8), (0.45, 0.4), (-0.45, -0.4)):
        assert terms(standing((speed, 0, 0)), a_box((3.0, 0.0, 0.7)))["walk"] == pytest.approx(
            expected, abs=1e-5
        )
    # at the box what counts is to stand 16 cm before a face of it, which here is as good as 20 cm
    # deep, and to look at it: half of that is there anyhow, a quarter for the place, a quarter for
    # the turn
    for (ahead_m, aside_m, yaw), expected in {
        (0.36, 0.0, 0.0): 1.0,
        (0.36, 0.0, math.pi): 0.75,
        (0.36, 0.0, 0.5): 0.875,
        (0.46, 0.0, 0.0): 0.75 + 0.25 * 0.75,
        (0.36, -0.2, 0.0): 0.75 + 0.25 * 0.5,
    }.items():
        found = terms(standing(yaw=yaw), a_box((ahead_m, aside_m, 0.7)))["walk"]
        assert found == pytest.approx(expected, abs=2e-3)


def test_reward_of_carrying_needs_hands_on_a_lifted_box() -> None:
    held = with_hands((0.4, -0.29, 1.0), (0.4, 0.29, 1.0))
    stand, pace = (0.4, 0.0, 0.8), (0.45, 0.0, 0.0)
    found = terms(held, a_box((0.4, 0.0, 1.0), start=stand, velocity=pace))
    assert found["grasp"] == pytest.approx(1.0)
    assert found["lift"] == pytest.approx(1.0, abs=1e-5)
    assert found["carry"] == pytest.approx(0.5, abs=1e-5)
    lower = terms(held, a_box((0.4, 0.0, 0.9), start=stand, velocity=pace))
    assert lower["lift"] == pytest.approx(0.5 * lower["grasp"], abs=1e-5)
    thrown = terms(standing(), a_box((0.4, 0.0, 1.0), start=stand, velocity=pace))
    assert thrown["carry"] < 0.2
    assert terms(held, a_box((0.4, 0.0, 1.0), velocity=(3.5, 0.0, 0.0)))[
        "overspeed"
    ] == pytest.approx(math.exp(-2.0) - 1.0, abs=1e-5)


def test_a_hand_off_its_hold_costs() -> None:
    """By hand: 0.15 m are 0.0225 m²: (exp(−0.18) + exp(−0.9)) / 2. Far away the wide part leads:
    0.4 m each are 0.32 m², exp(−2.56) / 2."""
    box = a_box((0.4, 0.0, 1.0))
    for right, left, worth in (
        ((0.4, -0.29, 1.0), (0.4, 0.29, 1.0), 1.0),
        ((0.25, -0.29, 1.0), (0.4, 0.29, 1.0), 0.6209),
        ((0.4, -0.29, 0.6), (0.4, 0.29, 0.6), 0.0387),
    ):
        assert terms(with_hands(right, left), box)["grasp"] == pytest.approx(worth, abs=1e-4)


@pytest.mark.parametrize(("moved_m", "lifted"), [(0.2, 0.0), (0.3, 0.5), (0.4, 1.0), (6.0, 1.0)])
def test_a_box_carried_at_the_height_of_its_stand_is_lifted_off_it(
    moved_m: float, lifted: float
) -> None:
    """Stands of 0.8 m are as high as people carry; the stand ends 0.19 m from its middle."""
    held = with_hands((0.4, -0.29, 1.0), (0.4, 0.29, 1.0))
    box = a_box((0.4, 0.0, 1.0), (5.0, 0.0, 0.7), (0.4 - moved_m, 0.0, 1.0), velocity=(0.9, 0, 0))
    found = terms(held, box)
    assert found["lift"] == pytest.approx(lifted, abs=1e-5)
    assert found["carry"] == pytest.approx(lifted, abs=1e-5)
    # pushed off without hands on it, it is not
    assert terms(standing(), box)["lift"] < 0.2


def test_a_box_dropped_beside_its_target_earns_what_its_distance_is_worth() -> None:
    target = (0.4, 0.0, 0.7)
    box = a_box((0.4, 0.4, 1.0), target, start=(3.0, 0.0, 0.7))
    near = 0.5 * (math.exp(-10 * (0.4**2 + 0.3**2)) + math.exp(-100 * (0.4**2 + 0.3**2)))
    dropped = terms(standing(), box)
    assert dropped["place"] == pytest.approx(near, abs=1e-5)
    assert dropped["grasp"] < 0.02  # the hands are away: nearly all is the box's place
    assert dropped["lift"] == dropped["carry"] == pytest.approx(near, abs=0.01)
    kept = terms(with_hands((0.4, 0.11, 1.0), (0.4, 0.69, 1.0)), box)
    # held there it is worth less than placed, so that it is not held for ever: 0.4 of what is
    # left to the whole
    assert kept["lift"] == kept["carry"] == pytest.approx(near + 0.4 * (1.0 - near), abs=1e-5)


@pytest.mark.parametrize(("phase", "worth"), [(0.0, 1.0), (math.pi / 3, 0.5), (math.pi, -1.0)])
def test_the_way_with_the_box_earns_by_its_progress(phase: float, worth: float) -> None:
    """0.9 m/s at this angle to the way to the target; away from it costs what the way there
    earned."""
    held = with_hands((0.4, -0.29, 1.0), (0.4, 0.29, 1.0))
    speed = (0.9 * math.cos(phase), 0.9 * math.sin(phase), 0.0)
    box = a_box((0.4, 0.0, 1.0), start=(0.4, 0.0, 0.8), velocity=speed)
    assert terms(held, box)["carry"] == pytest.approx(worth, abs=1e-4)


def test_circles_earn_nothing() -> None:
    """A walk in circles about the box or, with it in hand, about the target: the mean of the terms
    over the directions of a circle is 0."""
    directions = [(math.cos(k * math.pi / 6), math.sin(k * math.pi / 6), 0.0) for k in range(12)]
    held = with_hands((0.4, -0.29, 1.0), (0.4, 0.29, 1.0))
    carry, walk = [], []
    for x, y, z in directions:
        box = a_box((0.4, 0.0, 1.0), start=(0.4, 0.0, 0.8), velocity=(0.8 * x, 0.8 * y, z))
        carry.append(terms(held, box)["carry"])
        body = standing((0.8 * x, 0.8 * y, z))
        walk.append(terms(body, a_box((3.0, 0.0, 0.7)))["walk"])
    assert max(carry) > 0.8 and max(walk) > 0.6
    assert sum(carry) == pytest.approx(0.0, abs=1e-4)
    assert sum(walk) == pytest.approx(0.0, abs=1e-4)


def test_the_way_leads_round_the_stand_that_the_box_was_taken_from() -> None:
    """The target is straight behind the stand, 0.43 m ahead. A step aside earned 0, one back -0.5
    and one into the stand 0.5."""
    held = with_hands((0.3, -0.29, 1.0), (0.3, 0.29, 1.0))
    for velocity, expected in {
        (0.0, 0.45, 0.0): 0.5 * 0.55 / 0.43,
        (-0.45, 0.0, 0.0): -0.5 + 1.0,
        (0.45, 0.0, 0.0): 0.5 - 1.0,
    }.items():
        box = a_box((0.3, 0.0, 1.0), (5.0, 0.001, 0.7), (0.43, 0.0, 0.8), velocity)
        body = replace(held, root_velocity=torch.tensor([velocity]))
        assert terms(body, box)["carry"] == pytest.approx(expected, abs=5e-3)
    # 2 m on, or with the target on this side, it is straight
    for target, start in (((5.0, 0.0, 0.7), (-2.0, 0.0, 0.8)), ((-5.0, 0.0, 0.7), (0.6, 0, 0.8))):
        box = a_box((0.3, 0.0, 1.0), target, start, (0.45, 0.0, 0.0))
        body = replace(held, root_velocity=torch.tensor([[0.45, 0.0, 0.0]]))
        assert terms(body, box)["carry"] == pytest.approx(math.copysign(0.5, target[0]), abs=1e-4)


def test_lowering_a_box_onto_its_target_pays_at_every_height() -> None:
    """From 0.4 m above its place down to it, in hand; what it earns there is all."""
    target = (0.4, 0.0, 0.7)
    worths = []
    for above in (0.4, 0.3, 0.2, 0.1, 0.0):
        z = 0.7 + above
        hands = with_hands((0.4, -0.29, z), (0.4, 0.29, z))
        found = terms(hands, a_box((0.4, 0.0, z), target, start=(3.0, 0.0, 0.7)))
        worths.append(found["lift"] + found["carry"])
    assert all(later > before + 0.1 for before, later in pairwise(worths))
    assert worths[-1] == pytest.approx(2.0, abs=1e-5)


def test_a_box_put_down_is_worth_all() -> None:
    at = (1.5, 0.0, 0.7)
    found = terms(standing((0.3, 0, 0)), a_box(at, at, start=(-2.0, 0.0, 0.7)))
    assert {k: v for k, v in found.items() if k != "overspeed"} == pytest.approx(
        dict.fromkeys(("walk", "grasp", "lift", "carry", "place", "put_down"), 1.0), abs=1e-5
    )
    # in the hands 0.4 of the last term; 8 cm off 0.4 more of the rest
    for off, expected in ((0.0, 0.4), (0.08, 0.4 + 0.6 * 0.08 / 0.2), (0.3, 1.0)):
        hands = with_hands((1.5, -0.29 - off, 0.7), (1.5, 0.29 + off + 0.5, 0.7))
        found = terms(hands, a_box(at, at, start=(-2.0, 0.0, 0.7)))
        assert found["put_down"] == pytest.approx(expected, abs=1e-5)
        assert found["grasp"] == 1.0
    beside = terms(standing(), a_box((1.5, 0.11, 0.7), at))
    assert beside["put_down"] == 0.0
    expected = 0.5 * (math.exp(-10 * 0.11**2) + math.exp(-100 * 0.11**2))
    assert beside["place"] == pytest.approx(expected, abs=1e-5)
    assert Carry().error_m(standing(), a_box((1.5, 0.3, 0.3), at)).item() == pytest.approx(0.5)


def test_the_episode_ends_with_the_box_near_the_ground() -> None:
    task = Carry()
    assert not task.fell(standing(), a_box((1.0, 0.0, 0.31))).item()
    assert task.fell(standing(), a_box((1.0, 0.0, 0.29))).item()
    # a large box on its edge: its middle is higher, a corner touches
    assert task.fell(standing(), a_box((1.0, 0.0, 0.31), yaw=0.0)).item() is False
    tipped = a_box((1.0, 0.0, 0.31))
    assert tipped.box is not None
    roll = torch.tensor([[math.cos(0.6), math.sin(0.6), 0.0, 0.0]])
    leaning = replace(tipped.box, rotation=roll, half=1.2 * tipped.box.half)
    assert task.fell(standing(), replace(tipped, box=leaning, corners=leaning.corners())).item()


def test_leaning_on_the_box_earns_nothing() -> None:
    """Hands where they should be, the feet under the root and 0.35 m and half a metre behind it."""
    task, where = Carry(), a_box((0.36, 0.0, 1.0))
    names = list(task.terms)
    held = with_hands((0.36, -0.29, 1.0), (0.36, 0.29, 1.0))
    feet = [character.BODIES.index(f"{side}_foot") for side in ("right", "left")]
    found = []
    for behind in (0.0, 0.35, 0.5):
        position = held.position.clone()
        position[0, feet, 0], position[0, feet, 1] = held.root[0, 0] - behind, held.root[0, 1]
        terms = task.reward_terms(replace(held, position=position), where)[0]
        found.append((float(terms[names.index("walk")]), float(terms[names.index("grasp")])))
    assert found[0] == pytest.approx((1.0, 1.0), abs=1e-3)
    # half of what the feet's place 0.35 m off would earn: 1/8 of a quarter for it
    assert found[1] == pytest.approx((0.5 * (0.75 + 0.25 / 8), 0.5), abs=1e-3)
    assert found[2] == (0.0, 0.0)


def test_bending_to_the_box_costs_nothing_of_the_way() -> None:
    """Who bends has the root back: here 0.60 m from the box and going on at 0.3 m/s, the feet at
    their place 0.36 m before it. The term was -0.27 there, and 1 upright."""
    where, upright = a_box((0.36, 0.0, 0.7)), standing()
    position = upright.position.clone()
    position[0, 0] += torch.tensor([-0.24, 0.0, -0.2])
    moving = torch.tensor([[-0.3, 0.0, 0.0]])
    bent = replace(upright, position=position, root_velocity=moving)
    assert terms(upright, where)["walk"] == pytest.approx(1.0, abs=2e-3)
    assert terms(bent, where)["walk"] == pytest.approx(1.0, abs=2e-3)
    # a step back takes the feet along, and costs
    position[:] = upright.position + torch.tensor([-0.24, 0.0, 0.0])
    assert terms(replace(bent, position=position), where)["walk"] == pytest.approx(-0.8 / 3)


@pytest.mark.parametrize(("scale", "yaw", "edge_m"), [(1.0, 0, 0.2), (1.5, 0, 0.2625), (1, 0.5, 0)])
def test_the_approach_ends_as_far_from_the_edge_of_any_box(
    scale: float, yaw: float, edge_m: float
) -> None:
    """Full speed earns 0.8 up to 0.35 m before the edge, and is not asked for any nearer."""
    if yaw:  # half edges of 0.175 and 0.25 m, turned
        edge_m = 0.175 * math.cos(yaw) + 0.25 * math.sin(yaw)
    for apart_m, is_paid in ((0.36, True), (0.34, False)):
        where = a_box((edge_m + apart_m, 0.0, 0.7), yaw=yaw)
        assert where.box is not None
        where = replace(where, box=replace(where.box, half=scale * where.box.half))
        still, fast = (terms(standing((speed, 0, 0)), where)["walk"] for speed in (0.0, 0.9))
        assert fast - still == pytest.approx(0.8 if is_paid else 0.0, abs=1e-4)


def test_lying_across_the_box_is_a_fall() -> None:
    task, where = Carry(), a_box((0.4, 0.0, 0.7))
    upright = standing()
    assert not task.fell(upright, where).item()
    bent = upright.head.clone()
    bent[0, 2] = upright.root[0, 2] + 0.15
    assert not task.fell(replace(upright, head=bent), where).item()
    bent[0, 2] = upright.root[0, 2] + 0.05
    assert task.fell(replace(upright, head=bent), where).item()


def test_stages() -> None:
    task = Carry()
    held = with_hands((0.4, -0.29, 1.0), (0.4, 0.29, 1.0))

    def reached(body: features.Body, where: Target) -> list[str]:
        found = task.stage(body, where)[0].tolist()
        return [name for name, is_so in zip(task.stages, found, strict=True) if is_so]

    assert reached(standing(), a_box((3.0, 0.0, 0.7))) == []
    assert reached(standing(), a_box((0.5, 0.0, 0.7))) == ["approached"]
    assert reached(held, a_box((0.4, 0.0, 1.0))) == ["approached", "grasped"]
    lifted = a_box((0.4, 0.0, 1.0), start=(0.4, 0.0, 0.9))
    assert reached(held, lifted) == ["approached", "grasped", "lifted"]
    away = a_box((0.4, 0.0, 1.0), start=(-1.0, 0.0, 0.9))
    assert reached(held, away) == ["approached", "grasped", "lifted", "moved"]
    placed = a_box((3.0, 0.0, 0.7), (3.15, 0.0, 0.7), start=(0.0, 0.0, 0.7))
    assert reached(standing(), placed) == ["placed"]
    at = a_box((1.5, 0.0, 0.7), (1.5, 0.0, 0.7), start=(-2.0, 0.0, 0.7))
    for off, found in ((0.09, ["placed"]), (0.11, ["placed", "released"])):
        assert reached(with_hands((1.5, -0.29 - off, 0.7), (1.5, 0.9, 0.7)), at) == found
