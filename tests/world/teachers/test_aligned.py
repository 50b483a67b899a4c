"""The tracker that is laid over a box: labels do not depend on where the box stands and how it is
turned, the reference goes on with time and waits for who does not follow, and other
sizes and stands have variants of their own."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor

from tests.support.world.standing_clip import standing_clip
from world import rotations
from world.character import model as character
from world.config import CarryConfig, InitialStates, WorldConfig
from world.episodes.shard import Shard
from world.errors import ClipError
from world.motions.clip import Clip
from world.motions.library import MotionLibrary
from world.motions.synthetic.library import walking
from world.motions.uses.box import BOX
from world.motions.variants import variant
from world.objects.box_bank import BoxBank, boxes
from world.teachers import aligned
from world.teachers.aligned import AlignedTracker
from world.teachers.laid import AHEAD

N = 8
CONFIG = WorldConfig(
    task="carry",
    initial=InitialStates(0, 1, 0, near_m=(1.0, 1.5), standing_fraction=1.0),
    carry=CarryConfig(sizes=4, scale=(0.6, 0.9), stand_m=(0.5, 0.6)),
    episode_s=20.0,
)


def nothing(state: Tensor, _goal: Tensor) -> Tensor:
    """A tracker that adds nothing to the reference's set-points."""
    return torch.zeros(len(state), character.NU)


@pytest.fixture(scope="module")
def clip() -> Clip:
    return standing_clip()


def made(clip: Clip, teacher: AlignedTracker | None = None) -> Shard:
    library = MotionLibrary([clip, walking(np.random.default_rng(0), 1.0)], use=BOX)
    return Shard(CONFIG, library, BoxBank(boxes(CONFIG.carry)), range(N), 3, teacher)


def teacher(clip: Clip) -> AlignedTracker:
    bank = BoxBank(boxes(CONFIG.carry))
    return AlignedTracker(nothing, True, [clip], bank, CONFIG.carry.stand_m, N)


def lay(one: AlignedTracker, shard: Shard, at: int, quarter: int) -> tuple[Tensor, Tensor]:
    """Put the characters where the first variant's person is, `at` frames after its beginning, with
    boxes that are turned by quarter turns; returns the variants and their frames [n]."""
    target = shard._target()
    assert target.box is not None and one._pick is not None
    known, number = one._pick, torch.zeros(N, dtype=torch.int64)
    frame = known.low[number] + at
    box_yaw = torch.linspace(-2.0, 2.0, N) + quarter * np.pi / 2
    turn = torch.linspace(-2.0, 2.0, N) - known.anchor[number, 3]
    unit = rotations.cos_sin(turn)
    qpos, qvel = known.reference.qpos[frame].clone(), known.reference.qvel[frame].clone()
    off = rotations.turn(unit, qpos[:, :2] - known.anchor[number, :2])
    qpos[:, :2] = target.box.start[:, :2] + off
    qpos[:, 3:7] = rotations.multiply(rotations.from_heading(unit), qpos[:, 3:7])
    qvel[:, :2] = rotations.turn(unit, qvel[:, :2])
    shard._scenes._qpos.copy_(qpos.double())
    shard._scenes._qvel.copy_(qvel.double())
    facing = rotations.cos_sin(box_yaw)
    pose = torch.cat((target.box.start, rotations.from_heading(facing)), dim=1)
    shard._scenes.set_free(torch.arange(N), 0, pose, torch.zeros(N, 6))
    return number, frame


def test_the_label_is_the_clip_s_own_wherever_the_box_stands(clip: Clip) -> None:
    """A tracker that adds nothing gives the set-points of the variant's next frame. The boxes are
    square from above here, so that every quarter turn is the same box."""
    one = teacher(clip)
    assert one._pick is not None
    one._pick = replace(one._pick, half=one._pick.half[:, [1, 1, 2]])
    shard = made(clip)
    for quarter in (0, 1, 3):
        one.reset(torch.arange(N), shard._target())
        _, frame = lay(one, shard, 0, quarter)
        target = shard._target()
        assert target.box is not None
        square = replace(target, box=replace(target.box, half=target.box.half[:, [1, 1, 2]]))
        label = one.label(shard._scenes, square, shard._variant, 0)
        assert (one._stage == 1).all()
        known = one._pick.reference
        # which variant fits depends on the box of each scene; where it begins, on its frames
        started = one._pick.low[one._variant]
        assert ((one._frame - started).abs() <= 10).all()
        expected = known.set_point[one._frame + 1].double()
        torch.testing.assert_close(
            shard._scenes.set_points(label.double()), expected, atol=1e-5, rtol=0
        )
        assert frame.shape == (N,)


def test_the_reference_goes_on_and_waits(clip: Clip) -> None:
    one, shard = teacher(clip), made(clip)
    lay(one, shard, 0, 0)
    target = shard._target()
    one.label(shard._scenes, target, shard._variant, 0)
    following = one._stage == 1
    assert following.sum() >= N // 2
    first = one._frame.clone()
    one.label(shard._scenes, target, shard._variant, 1)
    assert torch.equal(one._frame[following], first[following] + 1)
    # who stands still does not see it pass: it waits some frames ahead of the nearest one
    for clock in range(2, AHEAD + 4):
        one.label(shard._scenes, target, shard._variant, clock)
    assert one._pick is not None
    bound = torch.minimum(first + AHEAD, one._pick.high[one._variant])
    assert torch.equal(one._frame[following], bound[following])


def test_nothing_is_labelled_away_from_the_box_and_once_it_is_taken(clip: Clip) -> None:
    one, shard = teacher(clip), made(clip)
    assert one.label(shard._scenes, shard._target(), shard._variant, 0).isnan().all()
    lay(one, shard, 0, 0)
    pose = shard._scenes.free_qpos[:, :7].float()
    pose[:, 2] += 0.2
    shard._scenes.set_free(torch.arange(N), 0, pose, torch.zeros(N, 6))
    assert one.label(shard._scenes, shard._target(), shard._variant, 0).isnan().all()


def turn_by(shard: Shard, angle: float) -> None:
    """Turn the characters on the spot."""
    spin = rotations.from_heading(rotations.cos_sin(torch.full((N,), angle)))
    qpos = shard._scenes._qpos
    qpos[:, 3:7] = rotations.multiply(spin.double(), qpos[:, 3:7])


def test_who_is_turned_from_the_box_is_not_labelled(clip: Clip) -> None:
    """A pick-up begins within 0.35 rad of the clip's heading and goes on within 0.5 rad until the
    grip: beyond, the tracker falls."""
    for angle, begins in ((0.3, True), (0.42, False), (3.1, False)):
        one, shard = teacher(clip), made(clip)
        lay(one, shard, 0, 0)
        turn_by(shard, angle)
        label = one.label(shard._scenes, shard._target(), shard._variant, 0)
        assert ((one._stage == 1).sum() >= N // 2) == begins
        assert label.isnan().all() != begins
    for angle, goes_on in ((0.42, True), (0.6, False)):
        one, shard = teacher(clip), made(clip)
        lay(one, shard, 0, 0)
        one.label(shard._scenes, shard._target(), shard._variant, 0)
        following = one._stage == 1
        turn_by(shard, angle)
        label = one.label(shard._scenes, shard._target(), shard._variant, 1)
        assert (one._stage[following] == (1 if goes_on else 0)).all()
        assert label[following].isnan().any(dim=1).all() != goes_on


def test_a_pushed_box_is_picked_up_where_it_is(clip: Clip) -> None:
    """Pushed by 8 cm together with the person before it, nothing changes."""
    labels = []
    for pushed in (0.0, 0.08):
        one, shard = teacher(clip), made(clip)
        lay(one, shard, 0, 0)
        pose = shard._scenes.free_qpos[:, :7].float()
        pose[:, 0] += pushed
        shard._scenes.set_free(torch.arange(N), 0, pose, torch.zeros(N, 6))
        shard._scenes._qpos[:, 0] += pushed
        labels.append(one.label(shard._scenes, shard._target(), shard._variant, 0))
        assert (one._stage == 1).sum() >= N // 2
    torch.testing.assert_close(labels[1], labels[0], atol=1e-4, rtol=0, equal_nan=True)


def test_a_box_at_its_target_is_put_down_as_in_the_clip(clip: Clip) -> None:
    """Someone who holds a box over its target, facing anywhere: the label is the variant's own."""
    one, shard = teacher(clip), made(clip)
    assert one._put is not None
    known, target = one._put, shard._target()
    assert target.box is not None
    wanted = known.half - target.box.half[:, None]
    number = wanted.abs().sum(dim=2).argmin(dim=1)
    frame = known.low[number] + 55
    turn = torch.linspace(-2.5, 2.5, N)
    unit = rotations.cos_sin(turn)
    here = target.box.target.clone()
    here[:, 2] = 0.0
    qpos, qvel = known.reference.qpos[frame].clone(), known.reference.qvel[frame].clone()
    level = torch.cat((known.anchor[number, :2], torch.zeros(N, 1)), dim=1)

    def placed(point: Tensor) -> Tensor:
        off = point - level
        return torch.cat((rotations.turn(unit, off[:, :2]), off[:, 2:]), dim=1) + here

    qpos[:, :3] = placed(qpos[:, :3])
    qpos[:, 3:7] = rotations.multiply(rotations.from_heading(unit), qpos[:, 3:7])
    qvel[:, :2] = rotations.turn(unit, qvel[:, :2])
    shard._scenes._qpos.copy_(qpos.double())
    shard._scenes._qvel.copy_(qvel.double())
    box = known.reference.box[frame]
    turned = rotations.multiply(rotations.from_heading(unit), box[:, 3:])
    pose = torch.cat((placed(box[:, :3]), turned), dim=1)
    shard._scenes.set_free(torch.arange(N), 0, pose, torch.zeros(N, 6))
    held = known.reference.held[frame]
    now = shard._target()
    assert now.box is not None
    now = replace(now, box=replace(now.box, half=known.half[number]))
    label = one.label(shard._scenes, now, shard._variant, 0)
    putting = one._stage == 2
    assert held.all() and putting.sum() >= N // 2
    expected = known.reference.set_point[one._frame + 1].double()
    found = shard._scenes.set_points(label.double())
    torch.testing.assert_close(found[putting], expected[putting], atol=1e-5, rtol=0)
    assert ((one._frame - known.low[one._variant] - 55).abs()[putting] <= 12).all()


def test_what_it_follows_is_continued(clip: Clip) -> None:
    one, other, shard = teacher(clip), teacher(clip), made(clip)
    lay(one, shard, 0, 0)
    one.label(shard._scenes, shard._target(), shard._variant, 0)
    other.load_state_dict({name: value.clone() for name, value in one.state_dict().items()})
    again = [t.label(shard._scenes, shard._target(), shard._variant, 1) for t in (one, other)]
    torch.testing.assert_close(again[0], again[1], rtol=0, atol=0, equal_nan=True)
    one.reset(torch.tensor([0]), shard._target())
    assert all(not value[0].any() for value in one.state_dict().values())


def test_there_are_variants_of_all_boxes_and_stands(clip: Clip) -> None:
    """Sizes within a factor of 1.12 of the bank's, both ways round; stands 0.1 m apart; of a clip
    and its variants one."""
    bank = BoxBank(boxes(CONFIG.carry))
    raised = variant(clip, 0.6, 1.0)
    assert raised is not None
    one = AlignedTracker(nothing, True, [clip, raised], bank, (0.5, 0.6), N)
    assert one._pick is not None and one._put is not None
    assert torch.equal(one._pick.stand.unique(), torch.tensor([0.5, 0.6]))
    for half in bank.half:
        for edges in (half, half[[1, 0, 2]]):
            ratio = (one._pick.half / edges).log().abs().amax(dim=1)
            assert ratio.min() < np.log(1.12)
    alone = teacher(clip)._pick
    assert alone is not None and len(one._pick.low) == len(alone.low), "a variant adds none"
    steps = one._pick.high - one._pick.low
    assert (steps <= aligned._BEFORE + aligned._AFTER).all() and (steps > 20).all()


def test_each_variant_is_made_once(clip: Clip, monkeypatch: pytest.MonkeyPatch) -> None:
    """For picking up and for putting down, which follow the same reference."""
    made: list[tuple[str, float, tuple[float, ...]]] = []

    def counted(clip: Clip, stand_m: float, size: Sequence[float]) -> Clip | None:
        made.append((clip.name, stand_m, tuple(size)))
        return variant(clip, stand_m, size)

    monkeypatch.setattr(aligned, "variant", counted)
    one = AlignedTracker(nothing, True, [clip], BoxBank(boxes(CONFIG.carry)), (0.5, 0.6), N)
    assert one._pick is not None and one._put is not None
    assert len(made) == len(set(made)) >= max(len(one._pick.low), len(one._put.low))
    assert one._pick.reference is one._put.reference


def test_a_clip_is_followed_until_the_box_is_raised_and_not_into_the_standing(clip: Clip) -> None:
    found = teacher(clip)._pick
    assert found is not None
    known = found.reference
    for number, high in enumerate(found.high.tolist()):
        first = int(known.first[number])
        at = first + int(torch.nonzero(known.held[first:])[0])
        last = min(at + 40, int(known.stop[number]) - 1)
        away = (found.keys[at : last + 1] - found.keys[last]).norm(dim=2).amax(dim=1)
        assert at + 12 <= high < last
        assert bool((away[high - at :] < 0.03).all())
        assert high == at + 12 or float(away[high - at - 1]) >= 0.03
        assert float(known.box[high, 2] - known.box[at, 2]) > 0.02


def test_clips_that_pick_nothing_up_are_refused(clip: Clip) -> None:
    assert clip.box is not None
    held = np.flatnonzero(clip.box.held)
    inside = clip.part(int(held[0]), int(held[-1]) + 1)
    with pytest.raises(ClipError, match="picks up a box"):
        teacher(inside)
