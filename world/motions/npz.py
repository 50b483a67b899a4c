"""Bounded reader of `.npz` files: arrays of numbers and text, unpacked on access.

A small file can unpack to gigabytes, and a header can state any shape: each array is checked before
it is unpacked.
"""

import io
import math
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from world.errors import ClipError
from world.placeholders import pointer

MAX_ARRAY_BYTES = 1 << 28
"""Greatest size of an unpacked array."""
MAX_FILE_BYTES = 1 << 29
"""Greatest size of all that is unpacked of one file."""
MAX_ARRAYS = 50_000
_HEAD_BYTES = 1 << 16
_KINDS = "biufUS"


class Arrays(Mapping[str, np.ndarray]):
    """The arrays of an open file by name, unpacked on access."""

    def __init__(self, archive: zipfile.ZipFile, path: Path) -> None:
        self._archive, self._path = archive, path
        self._entries = {
            entry.filename.removesuffix(".npy"): entry
            for entry in archive.infolist()
            if entry.filename.endswith(".npy")
        }
        self._left = MAX_FILE_BYTES
        if len(self._entries) > MAX_ARRAYS:
            raise ClipError(f"{path}: {len(self._entries)} arrays; at most {MAX_ARRAYS} are read")

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def __getitem__(self, name: str) -> np.ndarray:
        entry = self._entries[name]
        if entry.file_size > min(MAX_ARRAY_BYTES, self._left):
            raise ClipError(
                f"{self._path}: {name} unpacks to {entry.file_size} bytes; at most"
                f" {MAX_ARRAY_BYTES} an array and {MAX_FILE_BYTES} a file are read"
            )
        self._left -= entry.file_size
        with self._archive.open(entry) as file:
            data = file.read(entry.file_size)
        return array_of(io.BytesIO(data), len(data), f"{self._path}: {name}")


def scalar(value: np.ndarray | float | str) -> float:
    """The number of an array of any shape, numbers or text. Raises ValueError for different ones
    or none."""
    values = np.asarray(value)
    if values.dtype.kind == "S":
        values = np.char.decode(values, "latin-1")
    if values.dtype.kind == "b":
        raise ValueError("true or false in place of a number")
    values = values.astype(np.float64).reshape(-1)
    if not len(values):
        raise ValueError("no number in an empty array")
    if not (values == values[0]).all() and np.ptp(values) > 1e-6 * abs(values[0]):
        raise ValueError(f"{len(values)} different numbers in place of one")
    return float(values[0])


def array_of(file: BinaryIO, size: int, name: str) -> np.ndarray:
    """The array of `size` bytes of `.npy` content. Raises ClipError, which begins with `name`,
    where the header does not fit."""
    head = io.BytesIO(file.read(_HEAD_BYTES))
    version = np.lib.format.read_magic(head)
    if version not in ((1, 0), (2, 0), (3, 0)):
        raise ClipError(f"{name}: version {version} of .npy; 1 to 3 are read")
    reader = np.lib.format.read_array_header_1_0
    if version != (1, 0):
        reader = np.lib.format.read_array_header_2_0
    shape, fortran, kind = reader(head)
    if kind.hasobject or kind.names or kind.subdtype or kind.kind not in _KINDS:
        raise ClipError(f"{name}: an array of {str(kind)[:40]}; numbers and text are read")
    wanted = math.prod(shape) * kind.itemsize
    start = head.tell()
    if any(n < 0 for n in shape) or wanted != size - start or not kind.itemsize:
        raise ClipError(
            f"{name}: its header promises {list(shape)} of {kind}, {size - start} bytes follow"
        )
    file.seek(start)
    flat = np.frombuffer(file.read(wanted), kind)
    return flat.reshape(shape, order="F" if fortran else "C").copy()


@contextmanager
def opened(path: Path) -> Iterator[Arrays]:
    """Context with the arrays of a `.npz` file. A damaged file raises exceptions of zipfile and
    numpy, one that is out of bounds and a pointer in its place ClipError."""
    if what := pointer(path):
        raise ClipError(f"{path}: {what}")
    with zipfile.ZipFile(path) as archive:
        yield Arrays(archive, path)
