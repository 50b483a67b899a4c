"""Clip files: bodies by name, licences of the folder, every object given back, or one line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from world.character import model as character
from world.errors import ClipError
from world.motions import cache, clip_file, load
from world.motions.clip import Clip
from world.motions.objects import BoxTrack, Skeleton


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
    assert not list(tmp_path.glob(".*"))


def test_a_damaged_about_is_one_line(tmp_path: Path, carried: Clip) -> None:
    content = clip_file.arrays(carried) | {"about": np.array('{"name": "x", "seat": 3}')}
    clip_file.write_arrays(tmp_path / "c.npz", content)
    with pytest.raises(ClipError, match="'about'") as caught:
        load.read(tmp_path / "c.npz")
    assert "\n" not in str(caught.value)


def written(path: Path, **changes: object) -> Path:
    rotation = np.tile([1.0, 0, 0, 0], (4, 15, 1))
    held = {"fps": 29.6, "root_position_m": np.zeros((4, 3)), "local_rotation_wxyz": rotation,
            "body_names": np.array(character.BODIES)}  # fmt: skip
    np.savez(path, **(held | changes))  # pyright: ignore
    return path


def test_a_clip_is_named_after_its_file_and_licensed_by_its_folder(tmp_path: Path) -> None:
    (tmp_path / "README.md").write_text("- Licence: research only\n")
    found = clip_file.read(written(tmp_path / "chair004.npz"))
    assert (found.name, found.fps, found.frames) == ("chair004", 30, 4)
    assert found.licence == "Licence: research only" and found.source == "chair004.npz"


def test_further_bodies_are_left_out(tmp_path: Path) -> None:
    names = ["tail", *character.BODIES]
    rotation = np.tile([1.0, 0, 0, 0], (4, 16, 1))
    rotation[:, 0] = 0.5
    found = clip_file.read(
        written(tmp_path / "a.npz", body_names=np.array(names), local_rotation_wxyz=rotation)
    )
    assert found.local_rotation.shape == (4, 15, 4) and found.local_rotation[0, 0, 0] == 1.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"fps": 0.5}, "fps is 0.5; expected 1 to 1000"),
        ({"body_names": np.array(["a"] * 15)}, "does not fit the character: no pelvis"),
        ({"local_rotation_wxyz": np.zeros((4, 60))}, r"not \[T, 15, 4\]"),
    ],
)
def test_wrong_shapes_are_one_line(tmp_path: Path, changes: dict, said: str) -> None:
    with pytest.raises(ClipError, match=said) as caught:
        clip_file.read(written(tmp_path / "a.npz", **changes))
    assert "\n" not in str(caught.value)
