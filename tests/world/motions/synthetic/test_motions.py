"""The synthetic clips: joint ranges, planted feet, smoothness, seats and balance, clip by clip."""

from dataclasses import dataclass

import numpy as np
import pytest

from world.character import model as character
from world.motions import load
from world.motions.clip import Clip, Seat
from world.motions.synthetic import library, rotations, skeleton
from world.motions.synthetic.sitting import ROOT_ABOVE_SEAT_M

RANGES_DEG = {
    "torso": ((-60, 60), (-60, 90), (-50, 50)),
    "head": ((-50, 50), (-40, 60), (-45, 45)),
    "right_upper_arm": ((-180, 45), (-180, 60), (-90, 90)),
    "left_upper_arm": ((-45, 180), (-180, 60), (-90, 90)),
    "right_lower_arm": ((0, 0), (-160, 0), (0, 0)),
    "left_lower_arm": ((0, 0), (-160, 0), (0, 0)),
    "right_hand": ((0, 0), (0, 0), (0, 0)),
    "left_hand": ((0, 0), (0, 0), (0, 0)),
    "right_thigh": ((-60, 15), (-140, 60), (-60, 35)),
    "left_thigh": ((-15, 60), (-140, 60), (-35, 60)),
    "right_shin": ((0, 0), (0, 160), (0, 0)),
    "left_shin": ((0, 0), (0, 160), (0, 0)),
    "right_foot": ((-30, 30), (-55, 55), (-40, 40)),
    "left_foot": ((-30, 30), (-55, 55), (-40, 40)),
}
"""The character's joint ranges about x, y and z; hinges turn about y alone."""


@dataclass(frozen=True)
class Posed:
    """A clip with its bodies' positions and rotations in the world, and its local rotations."""

    clip: Clip
    positions: np.ndarray
    world: np.ndarray
    local: np.ndarray


def posed(clip: Clip) -> Posed:
    local = rotations.matrix(clip.local_rotation.astype(np.float64))
    return Posed(clip, *skeleton.place(clip.root_position_m.astype(np.float64), local), local)


@pytest.fixture(scope="module")
def every() -> list[Posed]:
    """All clips of the set; all tests of this process share their making."""
    return [posed(clip) for clip in load.own_clips()]


@pytest.fixture(scope="module")
def sits(every: list[Posed]) -> list[tuple[Posed, Seat]]:
    """Those that sit down, with their seats."""
    return [(one, one.clip.seat) for one in every if one.clip.seat is not None]


def standing(clip: Clip) -> np.ndarray:
    """[T] bool: the pelvis is at the height of one who stands, walks or bends a little."""
    return clip.root_position_m[:, 2] > 0.75


def test_joints_stay_in_their_ranges_and_hinges_on_their_axis(every: list[Posed]) -> None:
    for one in every:
        angles = np.degrees(rotations.rotation_vector(one.clip.local_rotation.astype(np.float64)))
        for name, ranges in RANGES_DEG.items():
            joint = angles[:, character.BODIES.index(name)]
            for axis, (low, high) in enumerate(ranges):
                assert joint[:, axis].min() >= low - 0.1, (one.clip.name, name, "xyz"[axis])
                assert joint[:, axis].max() <= high + 0.1, (one.clip.name, name, "xyz"[axis])


def test_lowest_point_of_the_feet_is_on_the_floor(every: list[Posed]) -> None:
    for one in every:
        clip, positions, world = one.clip, one.positions, one.world
        soles = np.stack([skeleton.sole_corners(positions, world, side) for side in (0, 1)])
        lowest = soles[..., 2].min((0, 2))
        assert lowest.min() > -0.002, clip.name
        # on a bed they are off it
        up = np.ones(clip.frames, bool) if clip.bed is None else standing(clip)
        assert lowest[up].max() < 0.002, clip.name


def test_what_touches_the_floor_does_not_slide(every: list[Posed]) -> None:
    for one in every:
        clip, positions, world = one.clip, one.positions, one.world
        speeds = []
        for side in (0, 1):
            corners = skeleton.sole_corners(positions, world, side)
            touching = (corners[:-1, :, 2] < 0.006) & (corners[1:, :, 2] < 0.006)
            moved = np.linalg.norm(np.diff(corners[..., :2], axis=0), axis=-1) * clip.fps
            speeds.append(moved[touching])
        assert np.concatenate(speeds).mean() < 0.02, clip.name


def test_feet_do_not_pass_through_each_other(every: list[Posed]) -> None:
    for one in every:
        clip, positions, world = one.clip, one.positions, one.world
        right, left = (skeleton.sole_corners(positions, world, side)[..., :2] for side in (0, 1))
        apart = np.full(clip.frames, -np.inf)
        for foot in (11, 14):  # separating axes of two rectangles
            for axis in (0, 1):
                line = world[:, foot, :2, axis]
                line = line / np.linalg.norm(line, axis=-1, keepdims=True)
                a, b = (np.einsum("tcj,tj->tc", corners, line) for corners in (right, left))
                apart = np.maximum(apart, np.maximum(a.min(1) - b.max(1), b.min(1) - a.max(1)))
        assert apart[standing(clip)].min() > 0.0, clip.name


def test_no_joint_is_faster_than_15_rad_s_and_nothing_jumps(every: list[Posed]) -> None:
    for one in every:
        clip, local = one.clip, one.local
        step = rotations.transpose(local[:-1]) @ local[1:]
        speed = rotations.rotation_vector(rotations.quaternion(step)) * clip.fps
        assert np.linalg.norm(speed, axis=-1).max() < 15.0, clip.name
        assert np.abs(np.diff(speed, axis=0)).max() < 13.0, (
            clip.name
        )  # a swing leg's change in one frame
        root = np.diff(clip.root_position_m.astype(np.float64), axis=0) * clip.fps
        assert np.linalg.norm(root, axis=-1).max() < 2.0, clip.name
        assert np.linalg.norm(np.diff(root, axis=0), axis=-1).max() < 0.6, clip.name
        quaternions = clip.local_rotation
        assert (np.sum(quaternions[1:] * quaternions[:-1], -1) > 0).all(), clip.name


def test_pelvis_rests_on_the_seat_facing_its_way(
    sits: list[tuple[Posed, Seat]],
) -> None:
    for one, seat in sits:
        clip, positions, world = one.clip, one.positions, one.world
        seated = slice(seat.from_frame, seat.to_frame)
        assert 3.0 <= (seat.to_frame - seat.from_frame) / clip.fps <= 6.1, clip.name
        height = positions[seated, 0, 2] - seat.point_m[2] - ROOT_ABOVE_SEAT_M
        assert np.abs(height).max() < 0.01, clip.name
        assert np.abs(positions[seated, 0, :2] - seat.point_m[:2]).max() < 0.01, clip.name
        yaw = np.arctan2(world[seated, 0, 1, 0], world[seated, 0, 0, 0])
        assert np.abs(np.angle(np.exp(1j * (yaw - seat.facing_rad)))).max() < 0.1, clip.name


def test_feet_stand_flat_from_sitting_down_to_standing_up(
    sits: list[tuple[Posed, Seat]],
) -> None:
    for one, seat in sits:
        clip, positions, world = one.clip, one.positions, one.world
        span = slice(seat.from_frame - 40, seat.to_frame + 35)
        for side in (0, 1):
            corners = skeleton.sole_corners(positions, world, side)[span]
            assert np.abs(corners[..., 2]).max() < 0.001, clip.name
            assert np.ptp(corners[..., :2], axis=0).max() < 0.001, clip.name


def test_weight_is_over_the_feet_until_shortly_before_the_seat(
    sits: list[tuple[Posed, Seat]],
) -> None:
    for one, seat in sits:
        clip, positions, world = one.clip, one.positions, one.world
        ahead = np.array([np.cos(seat.facing_rad), np.sin(seat.facing_rad)])
        mass = skeleton.centre_of_mass(positions, world)[:, :2] @ ahead
        ankle = positions[:, [11, 14], :2].mean(1) @ ahead
        down = slice(seat.from_frame - 45, seat.from_frame - 12)
        up = slice(seat.to_frame + 12, seat.to_frame + 40)
        for stretch in (down, up):
            over = (mass - ankle)[stretch]
            assert over.min() > skeleton.HEEL_M - 0.015 and over.max() < skeleton.TOE_M, clip.name


def test_trunk_flexes_as_people_do_and_hands_rest_on_the_thighs(
    sits: list[tuple[Posed, Seat]],
) -> None:
    for one, seat in sits:
        clip, positions, world = one.clip, one.positions, one.world
        flexion = np.degrees(
            np.arcsin(
                np.clip(
                    world[:, 1, 0, 2] * np.cos(seat.facing_rad)
                    + world[:, 1, 1, 2] * np.sin(seat.facing_rad),
                    -1,
                    1,
                )
            )
        )
        rising = flexion[seat.to_frame - 20 : seat.to_frame + 20].max()
        assert 35.0 < rising < 46.0, clip.name
        middle = (seat.from_frame + seat.to_frame) // 2
        assert -10.5 < flexion[middle] < 6.0, clip.name
        for hand, thigh in ((5, 9), (8, 12)):
            axis = -world[middle, thigh, :, 2]
            offset = positions[middle, hand] - positions[middle, thigh]
            along = offset @ axis
            assert 0.2 < along < 0.4, clip.name
            assert np.linalg.norm(offset - along * axis) == pytest.approx(0.105, abs=0.015), (
                clip.name
            )


def test_the_set_covers_what_it_says(every: list[Posed], sits: list[tuple[Posed, Seat]]) -> None:
    seconds = sum(one.clip.seconds for one in every)
    assert 20 * 60 < seconds < 27 * 60
    for kind in ("seat", "bed", "box"):
        used = [one.clip for one in every if getattr(one.clip, kind) is not None]
        assert sum(clip.seconds for clip in used) > 4 * 60, kind
    heights = {seat.point_m[2] for _, seat in sits}
    assert min(heights) == pytest.approx(0.36) and max(heights) == pytest.approx(0.52)
    assert len(heights) >= 6


def test_the_trunk_rests_on_the_bed_and_nothing_sinks_into_it(every: list[Posed]) -> None:
    beds = [(one, one.clip.bed) for one in every if one.clip.bed is not None]
    assert {round(bed.height_m, 2) for _, bed in beds} >= {0.30, 0.42, 0.55}
    for one, bed in beds:
        lying = slice(bed.from_frame, bed.to_frame)
        pelvis = one.positions[:, 0] + 0.07 * one.world[:, 0, :, 2]
        chest = one.positions[:, 1] + 0.12 * one.world[:, 1, :, 2]
        assert np.abs(pelvis[lying, 2] - 0.09 - bed.height_m).max() < 0.01, one.clip.name
        assert np.abs(chest[lying, 2] - 0.11 - bed.height_m).max() < 0.02, one.clip.name
        head = one.positions[:, 2] + 0.175 * one.world[:, 2, :, 2]
        off = head[lying, :2].mean(0) - bed.head_m[:2]
        assert np.linalg.norm(off) < 0.03, one.clip.name
        assert np.abs(one.positions[lying, 0, :2] - bed.hip_m[:2]).max() < 0.01, one.clip.name
        # whatever is over the mattress stays out of it: 3 cm of give under limbs and trunk
        away = one.positions[..., :2] - np.array(bed.hip_m[:2])
        inward = away @ -np.array([np.cos(bed.facing_rad), np.sin(bed.facing_rad)])
        over = inward > 0.0
        for body, radius in ((5, 0.04), (8, 0.04), (4, 0.04), (7, 0.04), (11, 0.03), (14, 0.03)):
            under = one.positions[:, body, 2] - radius - bed.height_m
            assert under[over[:, body]].min(initial=1.0) > -0.03, (one.clip.name, body)


def test_hands_press_the_box_and_it_keeps_clear_of_floor_and_trunk(every: list[Posed]) -> None:
    boxes = [(one, one.clip.box) for one in every if one.clip.box is not None]
    assert len(boxes) >= 12
    for one, box in boxes:
        hands = one.positions[:, [5, 8]]
        apart = np.linalg.norm(hands[:, 1] - hands[:, 0], axis=-1)[box.held]
        assert np.abs(apart - box.size_m[1] - 0.08).max() < 0.015, one.clip.name
        off = np.linalg.norm(hands.mean(1) - box.pose[:, :3], axis=-1)[box.held]
        assert off.max() < 0.005, one.clip.name
        # the task ends where a box is within 30 cm of the floor
        assert (box.pose[:, 2] - 0.5 * box.size_m[2]).min() > 0.30, one.clip.name
        turned = rotations.matrix(box.pose[:, 3:].astype(np.float64))
        for body, up, radius in ((0, 0.205, 0.07), (1, 0.12, 0.11)):
            centre = one.positions[:, body] + up * one.world[:, body, :, 2]
            inside = np.einsum("tji,tj->ti", turned, centre - box.pose[:, :3])
            beyond = np.maximum(np.abs(inside) - 0.5 * np.array(box.size_m), 0.0)
            distance = np.linalg.norm(beyond, axis=-1) - radius
            assert distance[box.held].min() > -0.02, (one.clip.name, body)


def test_body_and_box_balance_over_the_feet_while_lifting(every: list[Posed]) -> None:
    for one in every:
        box = one.clip.box
        if box is None:
            continue
        held = np.flatnonzero(box.held)
        mass = skeleton.centre_of_mass(one.positions, one.world)
        for frame in (held[0] - 10, held[0] - 2, held[-1] + 4, held[-1] + 12):
            yaw = one.world[frame, 0, :2, 0]
            ahead = yaw / np.linalg.norm(yaw)
            ankle = one.positions[frame, [11, 14], :2].mean(0)
            over = (mass[frame, :2] - ankle) @ ahead
            assert skeleton.HEEL_M < over < skeleton.TOE_M, (one.clip.name, frame)


@pytest.mark.parametrize("speed_m_s", [0.6, 0.8, 1.0, 1.2, 1.4, 1.6])
def test_walks_move_at_their_speed(speed_m_s: float, every: list[Posed]) -> None:
    clip = next(one.clip for one in every if one.clip.name == f"walk_{speed_m_s:.1f}")
    x = clip.root_position_m[4 * clip.fps : 7 * clip.fps, :2]
    assert np.linalg.norm(x[-1] - x[0]) / (len(x) - 1) * clip.fps == pytest.approx(
        speed_m_s, rel=0.08
    )


def test_the_same_seed_makes_the_same_clip() -> None:
    first, second = (
        library.sitting(np.random.default_rng(5), 0.42, 1.5, -0.4, 1, back=True) for _ in range(2)
    )
    assert np.array_equal(first.root_position_m, second.root_position_m)
    assert np.array_equal(first.local_rotation, second.local_rotation)
    other = library.sitting(np.random.default_rng(6), 0.42, 1.5, -0.4, 1, back=True)
    assert other.frames != first.frames or not np.array_equal(
        other.root_position_m, first.root_position_m
    )
