"""Arrays as streams of small messages: splitting and joining."""

from collections.abc import Iterator

import numpy as np

from rpc.codec import number_format, parse_format
from rpc.errors import CodecError

CHUNK = 512 << 10  # bytes per message: below gRPC's limit of 4 MB, and small enough to interleave


def split(array: np.ndarray, limit: int = CHUNK) -> Iterator[bytes]:
    """The raw little-endian bytes of an array in C order, at most `limit` at a time."""
    spelled = number_format(array)
    flat = np.ascontiguousarray(array, spelled).reshape(-1).view(np.uint8).data
    for start in range(0, len(flat), limit):
        yield bytes(flat[start : start + limit])


class Field:
    """An array that arrives in pieces; its size is known and bounded beforehand."""

    def __init__(self, name: str, spelled: str, shape: tuple[int, ...], max_bytes: int) -> None:
        """spelled: one of `codec.FORMATS`. Raises CodecError if format or size is out of bounds."""
        dtype = parse_format(spelled, shape)
        size = dtype.itemsize
        for n in shape:
            size *= n
        if size > max_bytes:
            raise CodecError(f"{name}: {size} bytes, must be at most {max_bytes}")
        self.name = name
        self._array = np.empty(shape, dtype)
        self._bytes = self._array.reshape(-1).view(np.uint8)
        self._filled = 0

    @property
    def size(self) -> int:
        """Bytes of the complete array."""
        return len(self._bytes)

    def add(self, data: bytes) -> None:
        """Append a piece; CodecError if the array would become too large."""
        end = self._filled + len(data)
        if end > len(self._bytes):
            raise CodecError(
                f"{self.name}: more than {len(self._bytes)} bytes, must be exactly that "
                f"({self._form()})"
            )
        self._bytes[self._filled : end] = np.frombuffer(data, np.uint8)
        self._filled = end

    def array(self) -> np.ndarray:
        """The complete array; CodecError if a part has not arrived."""
        if self._filled != len(self._bytes):
            raise CodecError(
                f"{self.name}: {self._filled} bytes, must be {len(self._bytes)} ({self._form()})"
            )
        return self._array

    def _form(self) -> str:
        return f"{self._array.dtype.str} {list(self._array.shape)}"
