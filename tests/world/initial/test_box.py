"""How episodes of carrying start: boxes on stands and in hand, and shards of them."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from world import random_streams, rotations
from world.character import features
from world.character import model as character
from world.config import CarryConfig, InitialStates, WorldConfig
from world.episodes.shard import Shard
from world.errors import ClipError
from world.initial.box import BoxSampler
from world.motions.library import MotionLibrary, StyleMixture, StyleSource
from world.motions.synthetic.carries import carrying
from world.motions.synthetic.library import walking
from world.motions.uses.box import BOX
from world.objects import clearance
from world.objects.box_bank import BoxBank, boxes, resting
from world.scene import box as box_scene
from world.scene.batch import Scenes
from world.tasks.carry import Carry, reach_m

CONFIG = WorldConfig(task="carry", carry=CarryConfig(sizes=12))


@pytest.fixture(scope="module")
def bank() -> BoxBank:
    return BoxBank(boxes(CONFIG.carry))


@pytest.fixture(scope="module")
def library() -> MotionLibrary:
    generator = np.random.default_rng(0)
    carried = [
        carrying(generator, (0.7 * width, width, 0.6 * width), heights, 1.5, 0.6)
        for width, heights in ((0.34, (0.5, 0.6)), (0.48, (0.6, 0.5)))
    ]
    return MotionLibrary([*carried, walking(generator, 1.0)], use=BOX)


def test_a_box_on_its_stand_stays_there(bank: BoxBank) -> None:
    n = len(bank)
    every = torch.arange(n)
    scenes = Scenes(bank.models, 0.35, 3.0)
    qpos = torch.from_numpy(character.standing_qpos()).expand(n, -1)
    there = torch.tensor([[2.0, 0.0, 0.6]]) + bank.half * torch.tensor([0.0, 0.0, 1.0])
    yaw = torch.tensor([[0.8, 0.6]]).expand(n, -1)
    layout = resting(there, yaw, there + torch.tensor([0.0, 3.0, 0.1]))
    none = torch.zeros(n, character.NV)
    scenes.set_state(every, qpos, none, there, yaw)
    bank.apply(scenes, every, every, layout)
    for _ in range(30):
        scenes.act(torch.zeros(n, 28))
    now = scenes.now(bank.target(every, layout))
    assert now.box is not None
    assert (now.box.position - there).norm(dim=1).max() < 2e-3
    assert now.box.velocity.norm(dim=1).max() < 5e-3


def test_starts_on_stands(library: MotionLibrary, bank: BoxBank) -> None:
    n = 1024
    config = replace(CONFIG, initial=InitialStates(0, 1, 1))
    states = BoxSampler(config, library, bank, 0).draw(torch.arange(n), torch.ones(n).long())
    layout, half = states.layout, bank.half[states.variant]
    low, high = config.carry.stand_m
    for rests in (layout.start, layout.target):
        top = (rests - half * torch.tensor([0.0, 0.0, 1.0]))[:, 2]
        assert low - 1e-5 <= top.min() < low + 0.01
        assert high - 0.01 < top.max() <= high + 1e-5
    distance = layout.start[:, :2].norm(dim=1)
    assert (distance >= half[:, :2].norm(dim=1) + 0.35 - 1e-5).all()
    assert distance[states.kind == 2].max() > 9.9
    carried = (layout.target - layout.start)[:, :2].norm(dim=1)
    assert 1.0 - 1e-5 <= carried.min() < 1.1
    assert 9.9 < carried.max() <= 10.0 + 1e-5
    assert (layout.target[:, :2].norm(dim=1) > 0.5).all()
    place = BoxSampler(config, library, bank, 0).target(states)
    assert not Carry().stage(features.body(states.qpos, states.qvel), place)[:, 4].any()


def test_a_box_in_front_has_a_long_side_towards_the_character(
    library: MotionLibrary, bank: BoxBank
) -> None:
    """Its long edges lie along y: the axis x, either way, is within 20 degrees of the bearing."""
    n = 2048

    def off_deg(front: float) -> torch.Tensor:
        config = replace(CONFIG, initial=InitialStates(0, 1, 0, front_fraction=front))
        states = BoxSampler(config, library, bank, 0).draw(torch.arange(n), torch.ones(n).long())
        place = states.layout.start[:, :2]
        bearing = place / place.norm(dim=1, keepdim=True)
        cosine = (bearing * states.layout.start_yaw).sum(dim=1)
        assert 0.45 < (cosine > 0).float().mean() < 0.55  # either long side
        return torch.rad2deg(torch.acos(cosine.abs().clamp_max(1.0)))

    front, any_yaw = off_deg(1.0), off_deg(0.0)
    assert 19.0 < front.max() < 20.1 and 9.0 < front.mean() < 11.0
    assert any_yaw.max() > 85.0 and 43.0 < any_yaw.mean() < 47.0


def test_starts_from_the_clips_have_the_box_in_hand(library: MotionLibrary, bank: BoxBank) -> None:
    n = 512
    config = replace(CONFIG, initial=InitialStates(1, 0, 0, reference_stages=(0, 0, 1)))
    sampler = BoxSampler(config, library, bank, 0)
    states = sampler.draw(torch.arange(n), torch.ones(n).long())
    place, body = sampler.target(states), features.body(states.qpos, states.qvel)
    assert place.box is not None
    # 12 sizes are 4 cm of width apart: half of that, for each hand half, and two neighbours
    assert reach_m(body, place.box).max() < 0.05
    stages = Carry().stage(body, place).float().mean(dim=0)
    assert stages[0] == 1.0
    assert stages[1] > 0.7
    press, weight = sampler.load_n(states)
    assert (press > 0.5 * weight / box_scene.FRICTION).all()
    # some of the targets are within reach of one who has only to put the box down
    off = (place.box.target - place.box.position)[:, :2].norm(dim=1)
    assert 0.15 < (off < 1.3).float().mean() < 0.8


def test_no_episode_starts_where_it_would_end(bank: BoxBank) -> None:
    """People pick boxes up from the floor too, where the task gives a box up as dropped."""
    n = 512
    generator = np.random.default_rng(0)
    low = carrying(generator, (0.24, 0.34, 0.2), (0.1, 0.1), 1.5, 0.6)
    library = MotionLibrary([low, walking(generator, 1.0)], use=BOX)
    config = replace(CONFIG, initial=InitialStates(1, 0, 0, reference_stages=(1, 1, 1)))
    sampler = BoxSampler(config, library, bank, 0)
    states = sampler.draw(torch.arange(n), torch.ones(n).long())
    assert library.box is not None and library.box.position[library.stages[0], 2].max() < 0.3
    assert states.layout.position[:, 2].min() > 0.34
    body = features.body(states.qpos, states.qvel)
    assert not Carry().fell(body, sampler.target(states)).any()


def test_boxes_that_fail_are_drawn_more_often(library: MotionLibrary, bank: BoxBank) -> None:
    config = replace(CONFIG, initial=InitialStates(0, 0.5, 0.5, focus=0.5))
    sampler, n = BoxSampler(config, library, bank, 0), 8192
    scenes, episodes = torch.arange(n), torch.ones(n, dtype=torch.int64)
    # a bank of twelve: by mass, which here grows with the number, groups of 2, 1, 2, 1, ...
    group = torch.tensor([0, 0, 1, 2, 2, 3, 4, 4, 5, 6, 6, 7])
    assert (bank.mass.diff() > 0).all() and len(bank) == 12

    def shares() -> torch.Tensor:
        return torch.bincount(sampler.draw(scenes, episodes).variant, minlength=12) / n

    even = torch.full((12,), 1 / 12)
    torch.testing.assert_close(shares(), even, atol=0.015, rtol=0)
    rates = torch.tensor([0.1, 0.1, 0.2, 0.2, 0.3, 0.3, 0.9, 0.9])
    sampler.update_sampling({"piece_sit": rates, "piece_carry": rates})
    wanted = 0.5 / 12 + 0.5 * rates[group] / rates[group].sum()
    torch.testing.assert_close(shares(), wanted, atol=0.015, rtol=0)
    sampler.update_sampling({"piece_carry": torch.zeros(8)})
    torch.testing.assert_close(shares(), even, atol=0.015, rtol=0)

    variant, kind = torch.tensor([0, 2, 11, 11]), torch.tensor([1, 2, 1, 0])
    told = sampler.episode_records(variant, kind)["piece_carry"]
    torch.testing.assert_close(told, torch.tensor([0, 1, 7, torch.nan]), equal_nan=True)
    assert BoxSampler(CONFIG, library, bank, 0).episode_records(variant, kind) == {}


def test_clips_without_a_box_are_refused_for_clip_starts(bank: BoxBank) -> None:
    clip = walking(np.random.default_rng(0), 1.0)
    with pytest.raises(ClipError, match="no clip carries a box"):
        BoxSampler(CONFIG, MotionLibrary([clip], use=BOX), bank, 0)


def test_style_sees_the_box(library: MotionLibrary) -> None:
    held = StyleMixture(locomotion=0.0, approach=0.0, transition=0.0)
    now, after = StyleSource(library, 0, held).sample(64, 1)
    place = now[:, features.OBJECT]
    # in the hands: ahead, between them, at their height
    hands = [now[:, features.STATE.slice(f"position_{side}_hand")] for side in ("right", "left")]
    middle = 0.5 * (hands[0] + hands[1])
    assert (place[:, :3] - middle).norm(dim=1).max() < 0.03
    assert (after[:, features.OBJECT] - place).abs().max() < 0.2


def test_a_box_in_hand_is_between_the_hands(library: MotionLibrary, bank: BoxBank) -> None:
    carry = replace(CONFIG.carry, in_hand=1.0, near_target=0.0)
    config = replace(CONFIG, initial=InitialStates(0, 1, 0, standing_fraction=1.0), carry=carry)
    sampler = BoxSampler(config, library, bank, 3)
    states = sampler.draw(torch.arange(24), torch.ones(24).long())
    box = sampler.target(states).box
    assert box is not None
    # the arms do not reach round the largest boxes
    narrow = box.half[:, 1] < 0.25
    assert narrow.sum() > 8
    body = features.body(states.qpos, states.qvel)
    assert reach_m(body, box)[narrow].max() < 0.04


def test_no_limb_begins_in_a_stand(library: MotionLibrary, bank: BoxBank) -> None:
    """Neither in the one that the box is taken from, nor in the target's: contacts would throw the
    character. In hand, both are moved away from it by 0.12 m."""
    box = library.box
    assert box is not None
    starts = torch.cat(library.start_stages)
    reference = replace(CONFIG, initial=InitialStates(1, 0, 0))
    sampler = BoxSampler(reference, library, bank, 4)
    states = sampler.draw(torch.arange(512), torch.zeros(512, dtype=torch.int64))
    assert torch.isin(states.frame, starts).all()
    centres = clearance.points(states.qpos)[:, clearance.LIMBS]
    half_height = bank.half[states.variant, 2]
    start, target = states.layout.start, states.layout.target
    yaw = rotations.yaw(states.layout.start_yaw)[:, None]
    # the target's stand is not turned
    for rest in (torch.cat((start, yaw), 1), torch.cat((target, torch.zeros_like(yaw)), 1)):
        depth = clearance.stand_depth(centres, rest, half_height)
        assert depth.max() < 0.02
    held = box.held[states.frame]
    put = (box.put[states.frame, :2] - library.qpos[states.frame, :2])[held]
    target = states.layout.target[held, :2]
    away = (target - put).norm(dim=1)
    putting = away < 0.2  # all others have a target elsewhere
    assert putting.sum() > 10
    torch.testing.assert_close(away[putting], torch.full_like(away[putting], 0.12))
    assert (target.norm(dim=1) > put.norm(dim=1))[putting].all()


def test_a_stand_is_as_deep_in_a_limb_as_it_is_drawn() -> None:
    """A sphere of 0.05 m, 0.03 m above the plate of a stand, beside it, and beside its column."""
    number = int(torch.nonzero(clearance.RADII[clearance.LIMBS] == 0.05)[0])
    centres = torch.full((3, len(clearance.LIMBS), 3), 9.0)
    centres[:, number] = torch.tensor(
        [[2.0, 1.0, 0.53], [2.0 + 0.19 + 0.04, 1.0, 0.485], [2.13, 1, 0.2]]
    )
    rest = torch.tensor([[2.0, 1.0, 0.6, 0.0]])
    depth = clearance.stand_depth(centres, rest, torch.tensor([0.1]))
    torch.testing.assert_close(depth, torch.tensor([0.02, 0.01, -0.03]), atol=1e-5, rtol=0)
    turned = torch.tensor([[2.0, 1.0, 0.6, np.pi / 4]])
    corner = clearance.stand_depth(centres, turned, torch.tensor([0.1]))
    # the corner reaches 0.19 * sqrt(2) m, beyond the sphere's centre: its edges are 0.027 m away
    inside = (0.19 * 2**0.5 - 0.23) / 2**0.5
    assert corner[1].item() == pytest.approx(0.05 + min(inside, 0.015), abs=1e-5)


def test_frames_with_a_box_in_hand_are_no_empty_walk(library: MotionLibrary) -> None:
    """Neither initial states nor what the discriminator learns and is tested on; of clips that show
    nothing else they are."""
    assert library.box is not None and library.box.held.any()
    assert not library.box.held[library.upright].any()
    assert not library.walks[library.box.held].any()
    held = library.box.held[library.held_out].float().mean().item()
    assert held > 0.5
    _, later = StyleSource(library, 0, StyleMixture(locomotion=1.0)).held_out(512, 0)
    # all others are walks, whose box is elsewhere
    near = (later[:, features.OBJECT][:, :2].norm(dim=1) < 0.7).float().mean().item()
    assert near == pytest.approx(held, abs=0.1)


def roll(shard: Shard, scenes: range, steps: int) -> torch.Tensor:
    rows = []
    for _ in range(steps):
        noise = random_streams.normal(7, torch.arange(scenes.start, scenes.stop), shard.clock, 28)
        step = shard.step(0.3 * noise)
        seen, goal = shard.observe()
        ended = step.fell | step.timed_out
        rows.append(torch.cat((seen, goal, step.reward[:, None], ended[:, None]), dim=1))
    return torch.stack(rows)


def test_sharding_and_continuing_change_no_bit(library: MotionLibrary, bank: BoxBank) -> None:
    config = replace(CONFIG, episode_s=0.8)
    whole = Shard(config, library, bank, range(64), 5)
    part = Shard(config, library, bank, range(32, 64), 5)
    expected = roll(whole, range(64), 12)
    assert torch.equal(roll(part, range(32, 64), 12), expected[:, 32:])
    saved = {name: value.clone() for name, value in part.state_dict().items()}
    following = roll(part, range(32, 64), 12)
    again = Shard(config, library, bank, range(32, 64), 5)
    again.load_state_dict(saved)
    assert torch.equal(roll(again, range(32, 64), 12), following)
    assert expected[..., -1].any()  # episodes ended, so resets are compared too


def test_reference_states_in_which_a_box_is_put_down(library: MotionLibrary, bank: BoxBank) -> None:
    """All with the box in hand where the fraction is 1, few where it is 0; the others stay."""
    n, initial = 2048, InitialStates(1, 0, 0, reference_stages=(0.3, 0.5, 0.2))
    drawn = []
    for fraction in (0.0, 0.5, 1.0):
        carry = replace(CONFIG.carry, putting_down=fraction)
        config = replace(CONFIG, initial=initial, carry=carry)
        drawn.append(
            BoxSampler(config, library, bank, 0).draw(torch.arange(n), torch.ones(n).long())
        )
    frames = library.box
    assert frames is not None

    def near_its_end(frame: torch.Tensor) -> torch.Tensor:
        return (frames.position[frame] - frames.put[frame, :3])[:, :2].norm(dim=1) < 0.6

    held = frames.held[drawn[0].frame]
    shares = [float(near_its_end(states.frame)[held].float().mean()) for states in drawn]
    assert 0.3 < shares[0] < 0.6
    assert shares[1] == pytest.approx((1.0 + shares[0]) / 2.0, abs=0.05)
    assert shares[2] == 1.0
    for states in drawn[1:]:
        assert torch.equal(states.frame[~held], drawn[0].frame[~held])
        assert torch.equal(frames.held[states.frame], held)


def test_reference_states_show_boxes_on_their_way_down(library: MotionLibrary) -> None:
    """Lowering is after the last contact stage, and no part of leaving: the frames after the box
    is let go are."""
    frames, pool = library.box, torch.cat(library.start_stages)
    assert frames is not None
    lowered = frames.held & frames.has_put & (library.number > 0)
    way = frames.position - frames.put[:, :3]
    lowered &= (way[:, :2].norm(dim=1) < 0.1) & (way[:, 2] < 0.05)
    usable = torch.cat(library.stages)
    usable = usable[lowered[usable] & ~BOX.unfit(library)[usable]]
    assert len(usable) > 10
    assert torch.isin(usable, pool).all()
    # and nothing in which the box was let go
    put = frames.has_put[pool] & ~frames.held[pool]
    gone = (frames.position - frames.put[:, :3])[pool].norm(dim=1) < 1e-3
    assert not (put & gone).any()
