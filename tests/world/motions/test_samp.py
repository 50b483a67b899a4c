"""Clips on the paper's body: names, rates and licences that files give."""

from pathlib import Path

import numpy as np
import pytest

from world.character import model as character
from world.errors import ClipError
from world.motions import samp


def write(path: Path, **changes: object) -> Path:
    rotation = np.tile([1.0, 0, 0, 0], (4, 15, 1))
    held = {"fps": 29.6, "root_position_m": np.zeros((4, 3)), "local_rotation_wxyz": rotation,
            "body_names": np.array(character.BODIES)}  # fmt: skip
    np.savez(path, **(held | changes))  # pyright: ignore
    return path


def test_a_clip_is_named_after_its_file_and_licensed_by_its_folder(tmp_path: Path) -> None:
    (tmp_path / "README.md").write_text("- Licence: research only\n")
    found = samp.read(write(tmp_path / "chair004.npz"))
    assert (found.name, found.fps, found.frames) == ("chair004", 30, 4)
    assert found.licence == "Licence: research only" and found.source == "chair004.npz"


def test_further_bodies_are_left_out(tmp_path: Path) -> None:
    names = ["tail", *character.BODIES]
    rotation = np.tile([1.0, 0, 0, 0], (4, 16, 1))
    rotation[:, 0] = 0.5
    found = samp.read(
        write(tmp_path / "a.npz", body_names=np.array(names), local_rotation_wxyz=rotation)
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
def test_what_does_not_fit_is_one_line(tmp_path: Path, changes: dict, said: str) -> None:
    with pytest.raises(ClipError, match=said) as caught:
        samp.read(write(tmp_path / "a.npz", **changes))
    assert "\n" not in str(caught.value)
