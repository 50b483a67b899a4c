"""Clip files give back every object, or one line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

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
    assert not list(tmp_path.glob("*.partial"))


def test_a_damaged_about_is_one_line(tmp_path: Path, carried: Clip) -> None:
    content = clip_file.arrays(carried) | {"about": np.array('{"name": "x", "seat": 3}')}
    clip_file.write_arrays(tmp_path / "c.npz", content)
    with pytest.raises(ClipError, match="'about'") as caught:
        load.read(tmp_path / "c.npz")
    assert "\n" not in str(caught.value)
