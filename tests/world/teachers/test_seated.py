"""The tracker that is laid over a seat: labels do not depend on where the seat stands and how it is
turned, the clip is one with such a seat, the reference goes on with time and waits for who does not
follow, a walker labels the way, and nothing is labelled far from all clips."""

import numpy as np
import pytest
import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.config import InitialStates, WorldConfig
from world.episodes.shard import Shard
from world.errors import ClipError
from world.furniture.catalogue import catalogue
from world.motions import load
from world.motions.clip import Clip
from world.motions.library import MotionLibrary
from world.motions.synthetic.library import walking
from world.objects.furniture_bank import FurnitureBank, variants
from world.teachers import seated
from world.teachers.laid import AHEAD
from world.teachers.seated import SeatedTracker
from world.teachers.walker import WalkerTeacher

N = 8
CONFIG = WorldConfig(
    task="sit",
    initial=InitialStates(0, 1, 0, near_m=(1.0, 1.5), standing_fraction=1.0),
    episode_s=20.0,
)


def nothing(state: Tensor, _goal: Tensor) -> Tensor:
    """A policy whose actions are 0: a tracker that adds nothing to the reference's set-points."""
    return torch.zeros(len(state), character.NU)


@pytest.fixture(scope="module")
def clips() -> list[Clip]:
    """Three clips with seats at 0.36, 0.40 and 0.50 m."""
    wanted = ("sit_seat_36_-125", "sit_seat_40_-35", "sit_stool_50_-50")
    return [clip for clip in load.own_clips() if clip.name in wanted]


@pytest.fixture(scope="module")
def bank() -> FurnitureBank:
    return FurnitureBank(variants(catalogue("train", 20), 1, CONFIG.scale))


def made(clips: list[Clip], bank: FurnitureBank, teacher: SeatedTracker | None = None) -> Shard:
    library = MotionLibrary([*clips, walking(np.random.default_rng(0), 1.0)])
    return Shard(CONFIG, library, bank, range(N), 3, teacher)


def lay(one: SeatedTracker, shard: Shard, number: int, at: int, off_m: float = 0.0) -> Tensor:
    """Put the characters before their seats as the person of clip `number` is, `at` frames after
    the clip's first, off_m to the side; returns the frame [n]."""
    target, known = shard._target(), one._sittings
    frame = known.low[number] + at + torch.zeros(N, dtype=torch.int64)
    turn = rotations.yaw(target.facing) - rotations.yaw(known.facing[number])
    unit = rotations.cos_sin(turn)
    qpos, qvel = known.reference.qpos[frame].clone(), known.reference.qvel[frame].clone()
    aside = torch.stack((-target.facing[:, 1], target.facing[:, 0]), dim=1)
    off = rotations.turn(unit, qpos[:, :2] - known.point[number, :2])
    qpos[:, :2] = target.point[:, :2] + off + off_m * aside
    qpos[:, 3:7] = rotations.multiply(rotations.from_heading(unit), qpos[:, 3:7])
    qvel[:, :2] = rotations.turn(unit, qvel[:, :2])
    shard._scenes._qpos.copy_(qpos.double())
    shard._scenes._qvel.copy_(qvel.double())
    return frame


def labels(one: SeatedTracker, shard: Shard) -> Tensor:
    return one.label(shard._scenes, shard._target(), torch.zeros(N, dtype=torch.int64), 0)


def test_the_label_is_the_clip_s_own_wherever_the_seat_stands(
    clips: list[Clip], bank: FurnitureBank
) -> None:
    """A tracker that adds nothing gives the set-points of the frame that is the state's own, or the
    next one; the clip that was laid is the one found, though seats differ by some centimetres."""
    one = SeatedTracker(nothing, True, clips, N)
    shard = made(clips, bank)
    facing = shard._target().facing
    assert float((facing - facing[0]).abs().max()) > 0.5  # they face differently
    frame = lay(one, shard, 1, 20)
    found = labels(one, shard)
    close = (shard._target().point[:, 2] - one._sittings.point[1, 2]).abs() < 0.02
    assert close.any() and (one._clip[close] == 1).all()
    torch.testing.assert_close(one._frame[close], frame[close])
    known = one._sittings.reference
    wanted = known.set_point[known.ahead(frame, 1)].double()
    given = shard._scenes.set_points(found.double())
    torch.testing.assert_close(given[close], wanted[close], atol=1e-5, rtol=0)


def test_the_clip_has_such_a_seat(clips: list[Clip], bank: FurnitureBank) -> None:
    one = SeatedTracker(nothing, True, clips, N)
    shard = made(clips, bank)
    lay(one, shard, 0, 0)
    labels(one, shard)
    heights = one._sittings.point[:, 2]
    for seat, clip in zip(shard._target().point[:, 2].tolist(), one._clip.tolist(), strict=True):
        off = (heights - seat).abs()
        # 0.08 m of seat cost as much as feet that are misplaced by half a metre
        assert float(off[clip]) <= float(off.min()) + 0.1


def test_the_reference_goes_on_and_waits(clips: list[Clip], bank: FurnitureBank) -> None:
    """One frame a step, at most ten ahead of the state, and not beyond the clip's end."""
    one = SeatedTracker(nothing, True, clips, N)
    shard = made(clips, bank)
    lay(one, shard, 1, 20)
    labels(one, shard)
    first = one._frame.clone()
    for _ in range(5):
        labels(one, shard)
    torch.testing.assert_close(one._frame, first + 5)
    for _ in range(40):
        labels(one, shard)
    torch.testing.assert_close(one._frame, first + AHEAD)
    lay(one, shard, 1, int(one._sittings.high[1] - one._sittings.low[1]))
    for _ in range(3):
        labels(one, shard)
    assert (one._frame <= one._sittings.high[one._clip]).all()


def test_nothing_is_labelled_far_from_all_clips(clips: list[Clip], bank: FurnitureBank) -> None:
    one = SeatedTracker(nothing, True, clips, N)
    shard = made(clips, bank)
    lay(one, shard, 1, 20, off_m=0.2)
    assert not labels(one, shard).isnan().any()
    lay(one, shard, 1, 20, off_m=2.0)
    assert labels(one, shard).isnan().all()


def test_a_walker_labels_the_way(clips: list[Clip], bank: FurnitureBank) -> None:
    """Far from the seat its labels are passed on and no clip is followed; at the edge, the back to
    it, the tracker takes over."""
    walker = WalkerTeacher(lambda state, _goal: torch.full((len(state), character.NU), 0.5))
    one = SeatedTracker(nothing, True, clips, N, walker)
    shard = made(clips, bank)
    assert (labels(one, shard) == 0.5).all() and (one._clip == seated._FREE).all()
    lay(one, shard, 1, 60)
    found = labels(one, shard)
    over = (found != 0.5).all(dim=1)
    assert over.any()
    assert (one._clip[over] != seated._FREE).all() and (one._clip[~over] == seated._FREE).all()


def test_state_and_reset(clips: list[Clip], bank: FurnitureBank) -> None:
    one, two = (SeatedTracker(nothing, True, clips, N) for _ in range(2))
    shard = made(clips, bank)
    lay(one, shard, 1, 20)
    labels(one, shard)
    two.load_state_dict({name: value.clone() for name, value in one.state_dict().items()})
    torch.testing.assert_close(labels(two, shard), labels(one, shard))
    one.reset(torch.tensor([0, 2]), shard._target())
    assert one._clip.tolist()[:4:2] == [seated._FREE] * 2 and one._clip[1] != seated._FREE


def test_without_a_sitting_clip() -> None:
    with pytest.raises(ClipError, match="no clip in which someone sits down"):
        SeatedTracker(nothing, True, [walking(np.random.default_rng(0), 1.0)], N)
