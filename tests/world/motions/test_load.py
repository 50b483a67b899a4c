"""Clips: what is read of files, and what is no clip."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.world.clips import saved
from world.character import model as character
from world.errors import ClipError
from world.motions import clip_file, load
from world.motions.clip import Clip


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


def test_smpl_parameters_beside_clips_are_left_out(tmp_path: Path, sitting: Clip) -> None:
    """As synthesize writes them; a clip whose name ends so is a clip."""
    for name in ("a.npz", "b.smpl.npz"):
        clip_file.write(tmp_path / name, sitting)
    assert load.note_others([str(tmp_path)]) == ""
    np.savez(tmp_path / "a.smpl.npz", poses=np.zeros((4, 156)), trans=np.zeros((4, 3)))
    assert [path.name for path in load.find([str(tmp_path)])] == ["a.npz", "b.smpl.npz"]
    assert load.note_others([str(tmp_path)]) == (
        "left out, SMPL parameters and not clips: a.smpl.npz"
    )
    assert len(load.clips([str(tmp_path)])) == 2
    with pytest.raises(
        ClipError, match=r"a\.smpl\.npz: SMPL parameters, not a clip .*motions import"
    ):
        load.clips([str(tmp_path / "a.smpl.npz")])
    (tmp_path / "c.smpl.npz").write_bytes(b"damaged")  # its reader says so
    with pytest.raises(ClipError, match=r"c.smpl.npz"):
        load.clips([str(tmp_path)])


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
