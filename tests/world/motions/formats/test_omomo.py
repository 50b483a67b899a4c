"""OMOMO's processed form, with its tracked box."""

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from tests.support.samp_clips import FOLDER
from world.errors import ClipError
from world.motions.formats import landmarks, omomo, registry

OMOMO = FOLDER.parent / "omomo"
needs_omomo = pytest.mark.skipif(not OMOMO.is_dir(), reason="no ../shared/motions/omomo")


def rows(frames: int = 5) -> np.ndarray:
    """Columns of a person who does not move, and a box that turns about z by 10 degrees a frame."""
    found = np.random.default_rng(0).standard_normal((frames, omomo.COLUMNS)).astype(np.float32)
    found[:, 383:591] = np.tile([0, 0, 0, 1.0], (frames, 52))
    turn = Rotation.from_euler("z", 10 * np.arange(frames)[:, None], degrees=True)
    found[:, 318:321], found[:, 321:325] = (1, 2, 3), turn.as_quat()
    return found


def saved(path: Path, content: object) -> Path:
    torch.save(content, path)
    return path


@pytest.mark.parametrize("wrap", [lambda t: t, lambda t: t.requires_grad_(), torch.nn.Parameter])
def test_columns_are_where_they_are_said_to_be(tmp_path: Path, wrap: object) -> None:
    expected = rows()
    path = saved(tmp_path / "sub1_largebox_001.pt", wrap(torch.from_numpy(expected)))  # pyright: ignore
    read = registry.read(path)
    assert (read.fps, read.up, read.unit_m) == (30.0, "z", 1.0)
    assert "the file does not say" in read.remarks[0]
    np.testing.assert_allclose(read.position[:, 1], expected[:, 165:168])
    np.testing.assert_allclose(read.position[:, 51], expected[:, 315:318])
    assert read.box is not None
    size, centre, axes = omomo.BOXES["largebox"]
    assert read.box.size_m == size
    turn = Rotation.from_euler("z", 20, degrees=True)
    np.testing.assert_allclose(
        read.box.position[2], np.array([1, 2, 3]) + turn.apply(centre), atol=1e-6
    )
    np.testing.assert_allclose(read.box.rotation[2], turn.as_matrix() @ axes, atol=2e-4)
    np.testing.assert_allclose(np.linalg.det(read.box.rotation), 1.0, atol=1e-9)
    # what is no box has no track
    other = registry.read(saved(tmp_path / "sub1_floorlamp_001.pt", torch.from_numpy(expected)))
    assert other.box is None and "floorlamp" in other.approximated[0]


class _Bomb:
    def __init__(self, path: Path) -> None:
        self._path = path

    def __reduce__(self) -> tuple[object, tuple[str, str]]:
        return open, (str(self._path), "w")


def test_what_is_no_motion_is_one_line(tmp_path: Path) -> None:
    flag = tmp_path / "ran"
    cases = {
        "list.pt": ([1, 2], "a list in place of a tensor"),
        "bomb.pt": (_Bomb(flag), "asks for"),
        "dict.pt": ({"a": torch.zeros(3)}, "a dict in place of a tensor"),
        "long.pt": (torch.zeros(4, 10), r"a tensor \[4, 10\]; processed OMOMO motions are \[T, 59"),
        "int.pt": (torch.zeros(4, 591, dtype=torch.int64), "torch.LongStorage"),
        "nan.pt": (torch.full((4, 591), torch.nan), "non-finite"),
        "zero.pt": (torch.zeros(4, 591), "no unit quaternions"),
        "part.pt": (torch.zeros(591, 4).T, "part of another"),
    }  # fmt: skip
    for name, (content, said) in cases.items():
        path = saved(tmp_path / name, content)
        with pytest.raises(ClipError, match=said) as caught:
            registry.read(path)
        assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    assert not flag.exists()
    (tmp_path / "torn.pt").write_bytes(b"PK\x03\x04")
    with pytest.raises(ClipError, match=r"torn.pt: not a readable torch tensor"):
        registry.read(tmp_path / "torn.pt")


def test_a_tensor_that_promises_more_than_the_file_holds(tmp_path: Path) -> None:
    whole = io.BytesIO()
    torch.save(torch.from_numpy(rows()), whole)
    path = tmp_path / "a.pt"
    with zipfile.ZipFile(whole) as old, zipfile.ZipFile(path, "w") as new:
        for entry in old.infolist():
            data = old.read(entry)
            new.writestr(entry, data[:100] if entry.filename.endswith("data/0") else data)
    with pytest.raises(ClipError, match=r"needs 2955 numbers; the file has 25"):
        registry.read(path)


@needs_omomo
@pytest.mark.parametrize("name", ["sub10_largebox_049", "sub3_largebox_003"])
def test_real_takes_have_a_persons_bones_and_a_box_that_stands_on_the_floor(name: str) -> None:
    path = OMOMO / f"{name}.pt"
    read = registry.read(path)
    theirs = torch.load(path, weights_only=True).detach().numpy()
    np.testing.assert_array_equal(omomo.tensor(path), theirs)
    assert read.names[landmarks.find(read)["left_wrist"]] == "L_Wrist"
    # the rotations are those of the joints in this order: bones keep still in their parents' axes
    for joint, parent in enumerate(read.parents):
        if parent >= 0:
            step = read.position[:, joint] - read.position[:, parent]
            own = np.einsum("tji,tj->ti", read.rotation[:, parent], step)
            assert np.ptp(own, axis=0).max() < 1e-4, read.names[joint]
    assert read.box is not None
    # before it is moved the box stands flat on the floor, within a centimetre
    reach = 0.5 * np.abs(read.box.rotation[0, 2]) @ np.array(read.box.size_m)
    assert abs(read.box.position[0, 2] - reach) < 0.01
    assert np.abs(read.box.rotation[0, 2]).max() > np.cos(np.deg2rad(1.5))
