"""Clips: what is read of files, mended, inferred and kept."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.support.samp_clips import FOLDER, needs_samp, prepared
from world.character import model as character
from world.errors import ClipError
from world.motions import cache, load
from world.motions.clip import Clip, Seat, hinge_angles, mirrored
from world.motions.fit import floor, poses, seat
from world.motions.library import MotionLibrary, StyleMixture, StyleSource


@pytest.fixture(scope="module")
def sitting() -> Clip:
    return next(clip for clip in load.own_clips() if clip.seat is not None)


def saved(path: Path, clip: Clip, **changes: np.ndarray) -> Path:
    fields = {
        "fps": np.array(clip.fps),
        "root_position_m": clip.root_position_m,
        "local_rotation_wxyz": clip.local_rotation,
        "body_names": np.array(character.BODIES),
    }
    np.savez(path, **(fields | changes))
    return path


def test_reading_reorders_bodies_by_name(tmp_path: Path, sitting: Clip) -> None:
    order = np.random.default_rng(0).permutation(15)
    path = saved(
        tmp_path / "c.npz",
        sitting,
        local_rotation_wxyz=sitting.local_rotation[:, order],
        body_names=np.array(character.BODIES)[order],
    )
    np.testing.assert_array_equal(load.read(path).local_rotation, sitting.local_rotation)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"body_names": np.array(["spine"] * 15)}, "does not fit the character"),
        ({"fps": np.array(0)}, "fps is 0"),
        ({"root_position_m": np.full((9, 3), np.nan, np.float32)}, "local_rotation must be"),
        ({"local_rotation_wxyz": np.zeros((5, 15, 4), np.float32)}, "must be"),
    ],
)
def test_misfits_are_one_clear_line(
    tmp_path: Path, sitting: Clip, changes: dict[str, np.ndarray], message: str
) -> None:
    path = saved(tmp_path / "c.npz", sitting, **changes)
    with pytest.raises(ClipError, match=message) as caught:
        load.read(path)
    assert "\n" not in str(caught.value)


def test_no_clips_and_unknown_formats(tmp_path: Path) -> None:
    with pytest.raises(ClipError, match="no clips found"):
        load.find([str(tmp_path)])
    with pytest.raises(ClipError, match="no such file or folder"):
        load.find([str(tmp_path / "none")])
    other = tmp_path / "a.fbx"
    other.write_text("x")
    with pytest.raises(ClipError, match="unknown clip format"):
        load.read(other)
    broken = tmp_path / "b.npz"
    broken.write_bytes(b"PK\x03\x04 not a zip")
    with pytest.raises(ClipError, match="not a readable"):
        load.read(broken)


def test_resampling_keeps_the_motion(sitting: Clip) -> None:
    doubled = floor.resampled(sitting, 60)
    again = floor.resampled(doubled, 30)
    frames = min(again.frames, sitting.frames)
    np.testing.assert_allclose(
        again.root_position_m[:frames], sitting.root_position_m[:frames], atol=1e-5
    )
    dot = np.abs((again.local_rotation[:frames] * sitting.local_rotation[:frames]).sum(-1))
    np.testing.assert_allclose(dot, 1.0, atol=1e-4)


def test_a_drifting_floor_is_mended(sitting: Clip) -> None:
    drift = 0.04 * np.sin(np.linspace(0, 3, sitting.frames)) - 0.05
    moved = replace(
        sitting,
        root_position_m=sitting.root_position_m + drift[:, None].astype(np.float32) * [0, 0, 1],
    )
    mended = floor.floor_mended(replace(moved, root_position_m=moved.root_position_m.astype("f4")))
    error = mended.root_position_m[:, 2] - sitting.root_position_m[:, 2]
    assert np.abs(error).max() < 0.02


def test_the_seat_is_found_where_the_clip_sat(sitting: Clip) -> None:
    known = sitting.seat
    assert known is not None
    found = seat.with_seats(replace(sitting, seat=None))[0].seat
    assert found is not None
    np.testing.assert_allclose(found.point_m, known.point_m, atol=0.02)
    turn = (found.facing_rad - known.facing_rad + np.pi) % (2 * np.pi) - np.pi
    assert abs(turn) < np.deg2rad(5)


def test_two_seats_are_two_clips(sitting: Clip) -> None:
    second = replace(
        sitting, root_position_m=sitting.root_position_m + np.array([3, 0, 0], np.float32)
    )
    both = replace(
        sitting,
        root_position_m=np.concatenate((sitting.root_position_m, second.root_position_m)),
        local_rotation=np.concatenate((sitting.local_rotation, second.local_rotation)),
        seat=None,
    )
    parts = seat.with_seats(both)
    assert [part.name for part in parts] == [f"{sitting.name}#1", f"{sitting.name}#2"]
    points = [part.seat.point_m for part in parts if part.seat]
    np.testing.assert_allclose(points[1][0] - points[0][0], 3.0, atol=0.02)


def test_mirroring_twice_is_the_clip(sitting: Clip) -> None:
    twice = mirrored(mirrored(sitting))
    np.testing.assert_array_equal(twice.root_position_m, sitting.root_position_m)
    np.testing.assert_array_equal(twice.local_rotation, sitting.local_rotation)
    assert twice.seat == sitting.seat


def test_cache_gives_back_the_same_clips(
    tmp_path: Path, sitting: Clip, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    made = []

    def make() -> list[Clip]:
        made.append(1)
        return [sitting]

    first, second = cache.cached("k", make), cache.cached("k", make)
    assert len(made) == 1
    assert first[0].seat == second[0].seat == sitting.seat
    np.testing.assert_array_equal(second[0].local_rotation, sitting.local_rotation)
    (tmp_path / "inhabit" / "clips-k.npz").write_bytes(b"damaged")
    assert cache.cached("k", make)[0].name == sitting.name
    assert len(made) == 2


def test_style_source_is_drawn_by_counter_and_holds_out(sitting: Clip) -> None:
    library = MotionLibrary([*load.own_clips()[:12], sitting])
    source = StyleSource(library, 3, StyleMixture())
    first, again = source.sample(256, 5), source.sample(256, 5)
    assert torch.equal(first[0], again[0])
    assert torch.equal(first[1], again[1])
    assert not torch.equal(first[0], source.sample(256, 6)[0])
    trained = set(library.upright.tolist()).union(*(p.tolist() for p in library.stages))
    assert not trained & set(library.held_out.tolist())
    state, following = source.held_out(256, 5)
    assert state.isfinite().all()
    # one control step apart: the root moves by less than a tenth of a metre
    assert (state[:, 0] - following[:, 0]).abs().max() < 0.1


@needs_samp
@pytest.mark.parametrize("name", ["armchair004", "chair_mo006", "chair_mo_sit2sit"])
def test_mocap_rests_on_its_inferred_seat(name: str) -> None:
    clip = prepared(name)
    assert isinstance(clip.seat, Seat)
    assert 0.35 < clip.seat.point_m[2] < 0.46
    position, rotation = poses.body_poses(clip)
    rest = slice(clip.seat.from_frame, clip.seat.to_frame)
    off = np.abs(poses.seat_clearance(position, rotation)[rest] - clip.seat.point_m[2])
    assert np.median(off) < 0.02


@needs_samp
@pytest.mark.parametrize("name", ["armchair004", "chair_mo006", "locomotion_random"])
def test_mocap_walks_on_the_floor(name: str) -> None:
    clip = prepared(name)
    position, rotation = poses.body_poses(clip)
    lowest = poses.sole_heights(position, rotation).min(axis=1)
    speed = np.linalg.norm(np.gradient(clip.root_position_m[:, :2], axis=0), axis=1) * clip.fps
    walking = (clip.root_position_m[:, 2] > 0.72) & (speed > 0.3)
    assert walking.sum() > 100
    assert np.percentile(np.abs(lowest[walking]), 95) < 0.02


@needs_samp
def test_elbows_and_knees_have_one_axis_and_lying_is_no_sitting() -> None:
    for path in sorted(FOLDER.glob("*.npz"))[::9]:
        _, swing = hinge_angles(load.read(path).local_rotation)
        assert swing.max() < np.deg2rad(2), path.name
    for name in ("lie_down", "lie_down_16", "lie_down_18"):
        assert load.clips((str(FOLDER / f"{name}.npz"),)) == []
