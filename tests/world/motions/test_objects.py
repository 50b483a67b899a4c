"""Objects put back into clips: against known truth, through noise, files, cuts and mirrors."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.support.samp_clips import FOLDER, needs_samp
from world import rotations
from world.errors import ClipError
from world.motions import cache, clip_file, load, segments
from world.motions.clip import Clip, mirrored
from world.motions.fit import poses
from world.motions.fit.bed import find_beds
from world.motions.fit.box import find_box
from world.motions.objects import Bed, BoxTrack, Skeleton
from world.motions.synthetic.carries import carrying
from world.motions.synthetic.lies import lying
from world.motions.uses.bed import BED
from world.motions.uses.box import BOX
from world.motions.uses.seat import SEAT


def a_carry(
    seed: int = 0, width_m: float = 0.4, heights_m: tuple[float, float] = (0.4, 0.7)
) -> Clip:
    size = (0.3, width_m, 0.25)
    return carrying(np.random.default_rng(seed), size, heights_m, 2.0, 1.2)


@pytest.fixture(scope="module")
def carried() -> Clip:
    return a_carry()


@pytest.fixture(scope="module")
def lain() -> Clip:
    return lying(np.random.default_rng(3), 0.45, 1.5, 0.4, -1, head_left=True)


def shaken(clip: Clip, position_m: float, angle_rad: float) -> Clip:
    """The clip as a camera system has it: smooth errors of a position and of every joint."""
    noise = np.random.default_rng(1)

    def drift(*shape: int) -> np.ndarray:
        knots = noise.standard_normal((clip.frames // 10 + 2, *shape))
        at = np.arange(clip.frames) / 10
        low = at.astype(int)
        share = (at - low).reshape(-1, *([1] * len(shape)))
        return knots[low] * (1 - share) + knots[low + 1] * share

    half = 0.5 * angle_rad * drift(15, 3)
    turn = np.concatenate((np.ones((clip.frames, 15, 1)), half), axis=-1)
    turn /= np.linalg.norm(turn, axis=-1, keepdims=True)
    local = rotations.multiply(torch.from_numpy(clip.local_rotation), torch.from_numpy(turn))
    moved = clip.root_position_m + position_m * drift(3)
    return replace(
        clip,
        root_position_m=moved.astype(np.float32),
        local_rotation=local.numpy().astype(np.float32),
    )


def angle_deg(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Angle between quaternions [T, 4], degrees."""
    return np.degrees(2 * np.arccos(np.clip(np.abs(np.sum(first * second, -1)), 0, 1)))


@pytest.mark.parametrize(
    ("seed", "width_m", "heights_m"),
    [(0, 0.4, (0.4, 0.7)), (1, 0.3, (0.34, 0.34)), (2, 0.5, (0.75, 0.36))],
)
def test_the_box_is_found_within_two_centimetres(
    seed: int, width_m: float, heights_m: tuple[float, float]
) -> None:
    clip = a_carry(seed, width_m, heights_m)
    known, found = clip.box, find_box(replace(clip, box=None))
    assert known is not None and found is not None
    off = np.linalg.norm(found.pose[:, :3] - known.pose[:, :3], axis=1)
    assert off.max() < 0.02
    assert angle_deg(found.pose[:, 3:], known.pose[:, 3:]).max() < 5.0
    assert found.size_m[1] == pytest.approx(width_m, abs=0.02)
    for edge in (0, -1):
        ours, theirs = np.flatnonzero(found.held)[edge], np.flatnonzero(known.held)[edge]
        assert abs(int(ours) - int(theirs)) <= 6


def test_a_found_box_rests_moves_smoothly_and_is_rigid_in_the_hands(carried: Clip) -> None:
    box = find_box(replace(carried, box=None))
    assert box is not None
    first, last = np.flatnonzero(box.held)[[0, -1]]
    for rest in (box.pose[:first], box.pose[last + 1 :]):
        assert np.abs(rest - rest[0]).max() < 1e-6
    velocity = np.diff(box.pose[:, :3], axis=0) * carried.fps
    # nothing jumps at grasp or release: no step of more than 0.3 m/s from frame to frame
    assert np.abs(np.diff(velocity, axis=0)).max() < 0.3
    position, _ = poses.body_poses(carried)
    hands = position[:, [5, 8]].numpy()
    rotation = rotations.matrix(torch.from_numpy(box.pose[:, 3:])).numpy()
    inside = np.einsum("tji,thj->thi", rotation, hands - box.pose[:, None, :3])[box.held]
    assert np.ptp(inside, axis=0).max() < 0.03


def test_a_shaken_box_is_found_too(carried: Clip) -> None:
    known = carried.box
    found = find_box(replace(shaken(carried, 0.003, np.deg2rad(0.5)), box=None))
    assert known is not None and found is not None
    off = np.linalg.norm(found.pose[:, :3] - known.pose[:, :3], axis=1)
    assert np.median(off) < 0.02
    assert off.max() < 0.06


@pytest.mark.parametrize("angle_deg_", [0.0, 2.0])
def test_the_bed_is_found_within_two_centimetres_and_five_degrees(
    lain: Clip, angle_deg_: float
) -> None:
    known = lain.bed
    clip = shaken(lain, 0.005 if angle_deg_ else 0.0, np.deg2rad(angle_deg_))
    (found,) = find_beds(replace(clip, bed=None))
    assert known is not None
    np.testing.assert_allclose(found.hip_m, known.hip_m, atol=0.02)
    np.testing.assert_allclose(found.head_m, known.head_m, atol=0.02 if not angle_deg_ else 0.04)
    turn = (found.facing_rad - known.facing_rad + np.pi) % (2 * np.pi) - np.pi
    assert abs(turn) < np.deg2rad(5)
    assert found.from_frame <= known.from_frame < known.to_frame <= found.to_frame


def test_lying_on_the_floor_is_no_bed(lain: Clip) -> None:
    lower = replace(
        lain, bed=None, root_position_m=lain.root_position_m - np.array([0, 0, 0.44], np.float32)
    )
    assert find_beds(lower) == []


def test_tasks_take_what_they_use(carried: Clip, lain: Clip) -> None:
    bare = replace(lain, bed=None)
    assert isinstance(BED.prepare(bare)[0].bed, Bed)
    assert SEAT.prepare(bare) == []
    assert BOX.prepare(carried)[0] is carried
    assert BED.prepare(carried) == []


def test_what_walks_carries_nothing() -> None:
    walks = [c for c in load.own_clips() if not (c.box or c.seat or c.bed)][:12]
    assert [c.name for c in walks if find_box(c) is not None] == []
    assert [c.name for c in walks if find_beds(c)] == []


def test_cutting_keeps_objects_in_step(carried: Clip, lain: Clip) -> None:
    assert carried.box is not None and lain.bed is not None
    part = carried.part(100, 300)
    assert part.box is not None and part.frames == 200
    np.testing.assert_array_equal(part.box.pose, carried.box.pose[100:300])
    middle = (lain.bed.from_frame + lain.bed.to_frame) // 2
    half = lain.part(middle, lain.frames)
    assert half.bed is not None
    assert (half.bed.from_frame, half.bed.to_frame) == (0, lain.bed.to_frame - middle)
    assert lain.part(0, 10).bed is None


def test_mirroring_mirrors_every_object(carried: Clip, lain: Clip) -> None:
    ghost = Skeleton(("a",), (-1,), np.ones((lain.frames, 1, 3), np.float32))
    twice = mirrored(mirrored(replace(lain, ghost=ghost)))
    assert twice.bed == lain.bed
    assert twice.ghost is not None and (twice.ghost.position_m == 1).all()
    once = mirrored(carried)
    known = carried.box
    assert once.box is not None and known is not None
    # what the mirrored hands carry is the mirrored box
    found = find_box(replace(once, box=None))
    assert found is not None
    assert np.linalg.norm(found.pose[:, :3] - once.box.pose[:, :3], axis=1).max() < 0.02
    assert angle_deg(found.pose[:, 3:], once.box.pose[:, 3:]).max() < 5.0
    back = mirrored(once).box
    assert back is not None
    np.testing.assert_array_equal(back.pose, known.pose)


def test_files_give_back_every_object(tmp_path: Path, carried: Clip, lain: Clip) -> None:
    ghost = Skeleton(("hip", "knee"), (-1, 0), np.zeros((carried.frames, 2, 3), np.float32))
    clips = [replace(carried, ghost=ghost, name="one"), replace(lain, name="two")]
    for clip in clips:
        clip_file.write(tmp_path / f"{clip.name}.npz", clip)
    cache.write(tmp_path / "all.npz", clips)
    read = [load.read(tmp_path / f"{clip.name}.npz") for clip in clips]
    for back in (*read, *cache.read(tmp_path / "all.npz")):
        clip = next(c for c in clips if c.name == back.name)
        np.testing.assert_array_equal(back.root_position_m, clip.root_position_m)
        assert (back.bed, back.seat, back.licence) == (clip.bed, clip.seat, clip.licence)
        for ours, theirs in ((back.box, clip.box), (back.ghost, clip.ghost)):
            assert (ours is None) == (theirs is None)
        if isinstance(back.box, BoxTrack) and clip.box:
            np.testing.assert_array_equal(back.box.pose, clip.box.pose)
            np.testing.assert_array_equal(back.box.held, clip.box.held)
            assert back.box.size_m == pytest.approx(clip.box.size_m)
        if back.ghost and clip.ghost:
            assert (back.ghost.names, back.ghost.parents) == (clip.ghost.names, clip.ghost.parents)
    assert not list(tmp_path.glob("*.partial"))


def test_a_damaged_about_is_one_line(tmp_path: Path, carried: Clip) -> None:
    content = clip_file.arrays(carried) | {"about": np.array('{"name": "x", "seat": 3}')}
    clip_file.write_arrays(tmp_path / "c.npz", content)
    with pytest.raises(ClipError, match="'about'") as caught:
        load.read(tmp_path / "c.npz")
    assert "\n" not in str(caught.value)


@needs_samp
@pytest.mark.parametrize("name", ["lie_down_3", "lie_down_12"])
def test_mocap_lies_on_a_low_bed(name: str) -> None:
    (clip,) = load.clips((str(FOLDER / f"{name}.npz"),), BED)
    assert clip.bed is not None
    assert 0.12 < clip.bed.height_m < 0.25
    apart = np.linalg.norm(np.subtract(clip.bed.head_m, clip.bed.hip_m))
    assert 0.5 < apart < 0.7
    assert (clip.bed.to_frame - clip.bed.from_frame) / clip.fps > 8


@needs_samp
@pytest.mark.parametrize("name", ["chair_mo006", "run_side"])
def test_mocap_without_a_box_or_a_bed_has_none(name: str) -> None:
    path = str(FOLDER / f"{name}.npz")
    assert all(clip.box is None for clip in load.clips((path,), BOX))
    assert all(clip.bed is None for clip in load.clips((path,), BED))


def test_stages_come_in_order_and_say_what_the_body_does(carried: Clip, lain: Clip) -> None:
    for clip in (carried, lain):
        stage = segments.stages(clip)
        order = [int(stage[0]), *stage[1:][np.diff(stage) != 0].tolist()]
        assert order == [0, 1, 2, 1, 3]
    assert carried.box is not None and lain.bed is not None
    lifted = segments.stages(carried) == segments.CONTACT
    assert carried.box.held[lifted].all()
    # in contact the box is up at the carrying height; picking up and putting down are transitions
    assert np.ptp(carried.box.pose[lifted, 2]) < 0.12
    first, last = np.flatnonzero(carried.box.held)[[0, -1]]
    stage = segments.stages(carried)
    assert (stage[[first - 15, first, last, last + 15]] == segments.TRANSITION).all()
    lying_down = segments.stages(lain)
    assert (lying_down[lain.bed.from_frame : lain.bed.to_frame] == segments.CONTACT).all()
    upright = lain.root_position_m[:, 2] > 0.75
    assert not (lying_down[~upright] == segments.APPROACH).any()


def test_bad_ranges_are_found_where_they_were_made(carried: Clip) -> None:
    assert segments.usable(carried).all()
    jump = carried.root_position_m.copy()
    jump[60:] += np.array([0.5, 0, 0], np.float32)
    bad = ~segments.usable(replace(carried, root_position_m=jump))
    assert bad[59:61].all() and not bad[:55].any() and not bad[66:].any()
    # a body that stands and is pushed sideways at 1 m/s slides on both soles
    still = replace(
        carried,
        root_position_m=carried.root_position_m[:1].repeat(90, 0)
        + np.linspace([0, 0, 0], [0, 3, 0], 90, dtype=np.float32),
        local_rotation=carried.local_rotation[:1].repeat(90, 0),
        box=None,
    )
    assert (~segments.usable(still))[10:80].all()
    # the right arm laid straight through the chest
    crossed = still.local_rotation.copy()
    crossed[40:50, 1], crossed[40:50, 3] = (1, 0, 0, 0), (np.cos(0.6), np.sin(0.6), 0, 0)
    crossed[40:50, 4] = (1, 0, 0, 0)
    inside = segments.overlapping(replace(still, local_rotation=crossed))
    assert inside[40:50].all() and not inside[:40].any() and not inside[50:].any()
