"""Arrays of a file are checked against its bytes before they are unpacked."""

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from world.errors import ClipError
from world.motions import npz


def content(array: np.ndarray) -> bytes:
    held = io.BytesIO()
    np.save(held, array)
    return held.getvalue()


def test_what_numpy_writes_is_read(tmp_path: Path) -> None:
    wanted = {
        "a": np.arange(12, dtype=np.float32).reshape(3, 4),
        "b": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        "words": np.array(["pelvis", "torso"]),
        "none": np.zeros((0, 3)),
    }
    np.savez_compressed(tmp_path / "a.npz", **wanted)
    with npz.opened(tmp_path / "a.npz") as found:
        assert set(found) == set(wanted) and len(found) == 4
        for name, array in wanted.items():
            np.testing.assert_array_equal(found[name], array)
            assert found[name].dtype == array.dtype


def test_headers_that_do_not_fit_are_refused() -> None:
    whole = content(np.zeros((3, 4)))
    for data in (whole[:-8], whole + b"12345678", whole.replace(b"(3, 4)", b"(9, 9)")):
        with pytest.raises(ClipError, match="x: its header promises"):
            npz.array_of(io.BytesIO(data), len(data), "x")
    objects = io.BytesIO()
    np.save(objects, np.array([{}], object), allow_pickle=True)
    data = objects.getvalue()
    with pytest.raises(ClipError, match=r"x: an array of .*; numbers and text are read"):
        npz.array_of(io.BytesIO(data), len(data), "x")


def test_what_would_fill_the_memory_is_not_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(npz, "MAX_ARRAY_BYTES", 1000)
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("big.npy", content(np.zeros(1000)))
        archive.writestr("small.npy", content(np.zeros(3)))
    with npz.opened(tmp_path / "a.npz") as found:
        assert found["small"].shape == (3,)
        with pytest.raises(ClipError, match="big unpacks to 8128 bytes; at most 1000"):
            found["big"]
    monkeypatch.setattr(npz, "MAX_ARRAYS", 1)
    with pytest.raises(ClipError, match="2 arrays; at most 1"), npz.opened(tmp_path / "a.npz"):
        pass
