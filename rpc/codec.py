"""msgpack with an extension type for arrays: dtype, shape and raw numbers; nothing is unpickled."""

import struct
from typing import Any

import msgpack
import numpy as np

from rpc.errors import CodecError

ARRAY = 1  # msgpack extension type of arrays
FORMATS = frozenset(
    ["|b1", "|u1", "|i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8"]
)
MAX_BYTES = 4 << 30
MAX_DIMENSIONS = 8


def pack(obj: Any) -> bytes:
    """Packed nested dicts, lists, scalars, strings, bytes and arrays (or CPU tensors).

    Tuples become lists. Raises CodecError for anything else, including arrays of objects.
    """
    try:
        return bytes(msgpack.packb(obj, default=_encode, use_bin_type=True) or b"")
    except (TypeError, ValueError, OverflowError) as error:
        raise CodecError(f"cannot be packed: {error}") from error


def unpack(data: bytes, max_bytes: int = MAX_BYTES) -> Any:
    """Object of packed bytes; arrays are writable copies.

    Raises CodecError for truncated or foreign bytes, and for more than `max_bytes`.
    """
    if len(data) > max_bytes:
        raise CodecError(f"{len(data)} bytes, must be at most {max_bytes}")
    try:
        return msgpack.unpackb(data, ext_hook=_decode, strict_map_key=False, raw=False)
    except CodecError:
        raise
    except (ValueError, msgpack.UnpackException, TypeError, RecursionError) as error:
        raise CodecError(f"not a packed message, or truncated: {error}") from error


def number_format(array: np.ndarray) -> str:
    """Little-endian format of an array, such as `<f4`; CodecError for other than FORMATS."""
    spelled = array.dtype.newbyteorder("<").str
    if spelled not in FORMATS:
        raise CodecError(f"arrays of {array.dtype}, must be one of {', '.join(sorted(FORMATS))}")
    return spelled


def parse_format(spelled: str, shape: tuple[int, ...]) -> np.dtype:
    """Dtype of an untrusted format; CodecError unless format and shape are within bounds."""
    if spelled not in FORMATS:
        raise CodecError(f"format {spelled!r}, must be one of {', '.join(sorted(FORMATS))}")
    if len(shape) > MAX_DIMENSIONS or any(n < 0 for n in shape):
        raise CodecError(f"shape {list(shape)}, must be at most {MAX_DIMENSIONS} sizes from 0 up")
    return np.dtype(spelled)


def _encode(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if not hasattr(value, "__array__"):
        raise CodecError(f"{type(value).__name__} cannot be packed: make it an array, list or dict")
    array = np.asarray(value)
    spelled = number_format(array)
    head = struct.pack("<3sB", spelled.encode(), array.ndim)
    head += struct.pack(f"<{array.ndim}Q", *array.shape)
    return msgpack.ExtType(ARRAY, head + np.ascontiguousarray(array, spelled).tobytes())


def _decode(kind: int, data: bytes) -> Any:
    if kind != ARRAY:
        raise CodecError(f"extension type {kind}, must be {ARRAY} (array)")
    try:
        spelled, dimensions = struct.unpack_from("<3sB", data)
        shape = struct.unpack_from(f"<{dimensions}Q", data, 4)
    except struct.error as error:
        raise CodecError("array header is truncated") from error
    dtype = parse_format(spelled.decode("ascii", "replace"), shape)
    start, count = 4 + 8 * dimensions, 1
    for size in shape:
        count *= size
    if len(data) - start != count * dtype.itemsize:
        raise CodecError(
            f"array of shape {list(shape)}: {len(data) - start} bytes, "
            f"must be {count * dtype.itemsize}"
        )
    return np.frombuffer(data, dtype, count, start).reshape(shape).copy()
