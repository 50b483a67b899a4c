"""Pickles of numbers are read, and nothing in one is run."""

import pickle
from collections import OrderedDict
from pathlib import Path

import numpy as np
import pytest

from world.errors import ClipError
from world.motions.formats import safe_pickle


class Call:
    """Asks whoever unpickles it to make a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple:
        return Path.touch, (self.path,)


@pytest.mark.parametrize("protocol", [2, 4])
def test_arrays_come_back(tmp_path: Path, protocol: int) -> None:
    held = OrderedDict(a=np.arange(6.0).reshape(2, 3), b=np.float64(0.1), c=["x", 3, b"\xff"])
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(held, protocol))
    found = safe_pickle.load(tmp_path / "a.pkl")
    np.testing.assert_array_equal(found["a"], held["a"])
    assert found["b"] == 0.1 and found["c"] == held["c"]
    assert safe_pickle.keys(found, tmp_path) == ("a", "b", "c")


def test_what_a_pickle_asks_for_is_named_and_not_done(tmp_path: Path) -> None:
    path, made = tmp_path / "a.pkl", tmp_path / "made"
    path.write_bytes(pickle.dumps({"a": Call(made)}))
    with pytest.raises(ClipError, match=r"refused: the pickle asks for (pathlib|builtins)"):
        safe_pickle.load(path)
    assert not made.exists()


def test_what_is_no_pickle_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.pkl"
    whole = pickle.dumps({"a": np.zeros(100)})
    for data in (b"", b"text", whole[:50], whole[:-1]):
        path.write_bytes(data)
        with pytest.raises(ClipError, match="not a readable pickle") as caught:
            safe_pickle.load(path)
        assert "\n" not in str(caught.value)
    with pytest.raises(ClipError, match="holds a list, not a motion's fields"):
        safe_pickle.keys([1], path)


def test_one_object_in_an_npy_file(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    np.save(path, np.array({"a": 1}, dtype=object), allow_pickle=True)
    assert safe_pickle.load_npy(path) == {"a": 1}
    np.save(path, np.zeros(3))
    with pytest.raises(ClipError, match=r"holds an array \[3\] of float64, not a motion"):
        safe_pickle.load_npy(path)
    path.write_bytes(b"nothing")
    with pytest.raises(ClipError, match=r"not a readable \.npy file"):
        safe_pickle.load_npy(path)
