"""The reader of pickles: numbers as they were; nothing is called with the file's words."""

import io
import pickle
import struct
from collections import OrderedDict
from pathlib import Path

import numpy as np
import pytest

from tests.support.paths import SHARED
from world.errors import ClipError
from world.motions import npz
from world.motions.formats import safe_pickle

HOSTILE = SHARED / "cases" / "hostile"
CONTENT = {
    "a": np.arange(12.0).reshape(3, 4),
    "f": np.asfortranarray(np.arange(6, dtype=np.float32).reshape(2, 3)),
    "big": np.arange(5, dtype=">i4"),
    "flags": np.array([True, False]),
    "one": np.float64(120.0),
    "flag": np.bool_(True),
    "list": [1, 2.5, "x", None],
    "names": np.array(["a", "bc"], dtype=object),
    "ordered": OrderedDict(x=np.zeros(2)),
    "pair": (np.ones(1), np.int64(3)),
}


@pytest.mark.parametrize("protocol", range(6))
def test_numbers_come_back_as_they_were(tmp_path: Path, protocol: int) -> None:
    path = tmp_path / "a.pkl"
    path.write_bytes(pickle.dumps(CONTENT, protocol=protocol))
    found = safe_pickle.load(path)
    assert list(found) == list(CONTENT)
    for key in ("a", "f", "big", "flags"):
        assert np.array_equal(found[key], CONTENT[key])
        assert found[key].dtype == CONTENT[key].dtype.newbyteorder("=")
    assert (found["one"], found["flag"], found["list"]) == (120.0, True, [1, 2.5, "x", None])
    assert found["names"] == ["a", "bc"], "an array of objects is a list"
    assert np.array_equal(found["ordered"]["x"], np.zeros(2))
    assert np.array_equal(found["pair"][0], np.ones(1)) and found["pair"][1] == 3


class Calls:
    """A pickle that calls a function of numpy."""

    def __init__(self, *reduced: object) -> None:
        self.reduced = reduced

    def __reduce__(self) -> tuple:
        return self.reduced


def _state(kind: object, raw: object, shape: tuple = (1,)) -> Calls:
    make = np.zeros(0).__reduce__()[0]
    return Calls(make, (np.ndarray, (0,), b"b"), (1, shape, kind, False, raw))


BAD = {
    "an array over memory": Calls(np.ndarray, ((4,), "f8", bytes(32), 0, (10**9,))),
    "an array of any size": Calls(np.ndarray, ((1 << 40,), "f8")),
    "objects over bytes": _state(np.dtype("O"), bytes(8)),
    "a shape beyond the bytes": _state(np.dtype("f8"), bytes(8), (1 << 50,)),
    "a negative shape": _state(np.dtype("f8"), bytes(8), (-1, -1)),
    "a type with parts": _state(np.dtype([("a", "f8")]), bytes(8)),
    "a type with a shape": Calls(np.dtype, ("(1000,1000,1000)f8",)),
    "a type of bytes": _state(np.dtype("V8"), bytes(8)),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_number_is_refused_in_a_line(tmp_path: Path, name: str) -> None:
    path = tmp_path / "bad.pkl"
    path.write_bytes(pickle.dumps({"frames": BAD[name], "fps": 30}))
    with pytest.raises(ClipError) as caught:
        safe_pickle.load(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_a_number_type_takes_no_other_size(tmp_path: Path) -> None:
    """The state of a type says a size of its own: 'f8' of 4096 bytes."""
    path = tmp_path / "size.pkl"
    content = pickle.dumps(np.zeros(2), protocol=2)
    wide = content.replace(b"J\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00t", b"M\x00\x10K\x01K\x00t")
    assert wide != content
    path.write_bytes(wide)
    with pytest.raises(ClipError, match="another size"):
        safe_pickle.load(path)


def test_places_of_the_memo_that_nobody_reached_are_not_made(tmp_path: Path) -> None:
    """The unpickler makes room up to the largest place: here 16 GiB for 8 bytes."""
    path = tmp_path / "memo.pkl"
    path.write_bytes(b"\x80\x02]r" + struct.pack("<I", 0x7FFFFFFF) + b".")
    with pytest.raises(ClipError, match="place 2147483647 of a memo"):
        safe_pickle.load(path)


def test_lists_within_lists_are_counted_first() -> None:
    value: list = [0.0] * 10
    for _ in range(7):
        value = [value] * 10  # 10^8 numbers in 80 places
    with pytest.raises(ValueError, match="more than"):
        safe_pickle.numbers(value)
    for _ in range(30):
        value = [value, value]
    with pytest.raises(ValueError, match="deep"):
        safe_pickle.numbers(value)
    assert safe_pickle.numbers([[1, 2], [3, 4.5]]).tolist() == [[1, 2], [3, 4.5]]
    assert safe_pickle.number(np.array([[7]])) == 7.0


@pytest.mark.skipif(not HOSTILE.is_dir(), reason="no hostile files beside the project")
def test_the_collected_pickles_are_refused() -> None:
    paths = sorted((HOSTILE / "pickles").glob("*.pkl"))
    assert len(paths) >= 16
    for path in paths:
        try:
            content = safe_pickle.load(path)
        except ClipError as error:
            assert path.name in str(error) and "\n" not in str(error)
            continue
        with pytest.raises(ValueError):
            safe_pickle.numbers(content["frames"])


def _npz(path: Path, head: str, size: int) -> Path:
    import zipfile

    text = (head + " " * (117 - len(head)) + "\n").encode()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        content = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text
        archive.writestr("trans.npy", content + bytes(size))
    return path


def test_a_header_promises_no_more_than_the_file_has(tmp_path: Path) -> None:
    path = _npz(
        tmp_path / "a.npz", "{'descr':'<f8','fortran_order':False,'shape':(10**14,3),}", 100
    )
    with pytest.raises(Exception), npz.opened(path) as file:  # noqa: B017 - any refusal
        file["trans"]
    lie = "{'descr':'<f8','fortran_order':False,'shape':(100000000000,3),}"
    with (
        pytest.raises(ClipError, match="its header promises"),
        npz.opened(_npz(path, lie, 100)) as file,
    ):
        file["trans"]


def test_a_bomb_is_not_unpacked(tmp_path: Path) -> None:
    size = npz.MAX_ARRAY_BYTES + 8
    head = f"{{'descr':'<f8','fortran_order':False,'shape':({size // 8},),}}"
    path = _npz(tmp_path / "bomb.npz", head, size)
    assert path.stat().st_size < 1e6
    with pytest.raises(ClipError, match="at most 268435456 an array"), npz.opened(path) as file:
        file["trans"]


def test_arrays_of_numpy_come_back(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    content = {"a": np.arange(6.0).reshape(2, 3), "names": np.array(["x", "yz"]), "n": np.array(3)}
    np.savez(path, a=content["a"], names=content["names"], n=content["n"])
    with npz.opened(path) as file:
        assert set(file) == set(content)
        for name, value in content.items():
            assert np.array_equal(file[name], value) and file[name].dtype == value.dtype
    objects = io.BytesIO()
    np.save(objects, np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(ClipError, match="an array of object"):
        npz.array_of(io.BytesIO(objects.getvalue()), len(objects.getvalue()), "x")
