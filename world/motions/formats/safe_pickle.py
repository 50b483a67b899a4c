"""Reader of pickles that executes no code: numbers, text, containers and numeric arrays only.

No function of numpy gets arguments of the file. Arrays are made here, of a short list of number
types, from bytes whose count fits the shape; an array of objects becomes a list.
"""

import io
import math
import pickle
import pickletools
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from world.errors import ClipError
from world.motions import npz
from world.placeholders import read_bounded
from world.refusals import why

#: Number types of arrays and scalars, numpy's names without byte order.
NUMBERS = frozenset(
    ("b1", "i1", "u1", "i2", "u2", "f2", "i4", "u4", "f4", "i8", "u8", "f8")
)  # fmt: skip
#: Greatest size of an array, and of a pickle, bytes.
MAX_ARRAY_BYTES = 1 << 28
MAX_BYTES = 1 << 29
MAX_LISTED = 4_000_000
"""Greatest count of numbers in lists: an hour of motion at 30 Hz."""
_MAX_DIMENSIONS = 8
_TEXT = re.compile(r"[SUa]\d{1,6}")
#: Opcodes that refer to objects outside the file.
_OUTSIDE = frozenset(
    ("PERSID", "BINPERSID", "EXT1", "EXT2", "EXT4", "NEXT_BUFFER", "READONLY_BUFFER", "INST", "OBJ")
)
_MEMO = frozenset(("PUT", "BINPUT", "LONG_BINPUT"))


class RefusedError(pickle.UnpicklingError):
    """A pickle with something other than numbers."""


class _Inert:
    """Base of objects that a pickle may contain but not change: no attributes, no state."""

    __slots__ = ()

    def __setstate__(self, state: Any) -> None:
        raise RefusedError("a state for what has none")


class _Type(_Inert):
    """Stand-in for the class of arrays, which is not callable."""

    __slots__ = ()


class _Dtype:
    """A number type of a pickle; `number` is None for objects, and for text, which is not read."""

    __slots__ = ("is_object", "number")

    def __init__(self, spelled: Any) -> None:
        text = spelled.decode("latin1") if isinstance(spelled, bytes) else spelled
        if not isinstance(text, str):
            raise RefusedError("an array of no number type")
        plain = text.lstrip("<>=|")
        self.is_object = plain in ("O", "O4", "O8")
        self.number: np.dtype | None = None
        if plain in NUMBERS:
            self.number = np.dtype(("<" if text[:1] != ">" else ">") + plain)
        elif not self.is_object and not _TEXT.fullmatch(plain):
            raise RefusedError(f"an array of '{text[:20]}'")

    def __setstate__(self, state: Any) -> None:
        """Check the state of a number type, which holds the byte order alone."""
        if not (isinstance(state, tuple) and len(state) >= 8 and state[2:5] == (None, None, None)):
            raise RefusedError("a number type with parts")
        order = state[1].decode("latin1") if isinstance(state[1], bytes) else state[1]
        if order not in ("<", ">", "|", "="):
            raise RefusedError("a number type with parts")
        if self.number is not None:
            if state[5:7] != (-1, -1):
                raise RefusedError("a number type of another size")
            self.number = self.number.newbyteorder(">" if order == ">" else "<")


class _Array:
    """An array under construction: empty until its state is set."""

    __slots__ = ("content",)

    def __init__(self) -> None:
        self.content: Any = None

    def __setstate__(self, state: Any) -> None:
        if not isinstance(state, tuple) or len(state) not in (4, 5):
            raise RefusedError("an array of another form")
        shape, kind, fortran, raw = state[-4:]
        self.content = _array(shape, kind, raw, "F" if fortran is True else "C")


def _array(shape: Any, kind: Any, raw: Any, order: str) -> Any:
    """The array of a state: numbers copied from bytes, objects as a list, text omitted."""
    if not isinstance(kind, _Dtype):
        raise RefusedError("an array of no number type")
    if isinstance(shape, int) and not isinstance(shape, bool):
        shape = (shape,)
    if not isinstance(shape, tuple) or len(shape) > _MAX_DIMENSIONS:
        raise RefusedError("an array of no shape")
    if not all(type(size) is int and size >= 0 for size in shape):
        raise RefusedError("an array of no shape")
    count = math.prod(shape)
    if kind.is_object:
        if not isinstance(raw, list) or len(raw) != count:
            raise RefusedError("an array of objects over bytes")
        return raw[0] if shape == () else raw
    if kind.number is None:
        return None
    if isinstance(raw, str):
        raw = raw.encode("latin1")
    if not isinstance(raw, bytes | bytearray):
        raise RefusedError("an array without its bytes")
    size = count * kind.number.itemsize
    if size != len(raw) or size > MAX_ARRAY_BYTES:
        raise RefusedError(f"an array of {size} bytes from {len(raw)}")
    native = np.frombuffer(raw, kind.number).astype(kind.number.newbyteorder("="))
    return native.reshape(shape, order="F" if order == "F" else "C")


class _Maker(_Inert):
    """A function that a pickle may call."""

    __slots__ = ("_make",)

    def __init__(self, make: Any) -> None:
        self._make = make

    def __call__(self, *arguments: Any) -> Any:
        return self._make(*arguments)


def _reconstruct(kind: Any, shape: Any, code: Any) -> _Array:
    if not isinstance(kind, _Type):
        raise RefusedError("an array of another class")
    return _Array()


def _scalar(kind: Any, raw: Any = b"") -> Any:
    if not isinstance(kind, _Dtype) or kind.is_object:
        raise RefusedError("a scalar that is no number")
    return None if kind.number is None else _array((), kind, raw, "C")[()]


def _buffered(raw: Any, kind: Any, shape: Any, order: Any) -> Any:
    return _array(shape, kind, raw, order)


def _encoded(text: Any, coding: Any) -> bytes:
    if not isinstance(text, str) or coding not in ("latin1", "latin-1"):
        raise RefusedError("bytes in an encoding other than latin1")
    return text.encode("latin1")


#: All globals that a pickle of arrays needs, by module and name; all others are refused.
_ALLOWED = {
    ("collections", "OrderedDict"): _Maker(lambda *items: dict(*items)),
    ("numpy", "ndarray"): _Type(),
    ("numpy", "dtype"): _Maker(lambda spelled, *_: _Dtype(spelled)),
    # protocol 2 writes bytes as encoded text
    ("_codecs", "encode"): _Maker(_encoded),
}
for _core in ("numpy.core", "numpy._core"):
    _ALLOWED |= {
        (f"{_core}.multiarray", "_reconstruct"): _Maker(_reconstruct),
        (f"{_core}.multiarray", "scalar"): _Maker(_scalar),
        (f"{_core}.numeric", "_frombuffer"): _Maker(_buffered),
    }


@dataclass(frozen=True)
class Tensor:
    """A tensor of a torch file: where its numbers are, their type, and its shape."""

    key: str
    kind: np.dtype
    shape: tuple[int, ...]

    @property
    def count(self) -> int:
        return math.prod(self.shape)


class _Storage(_Inert):
    """A type of torch's storages."""

    __slots__ = ("kind",)

    def __init__(self, kind: str) -> None:
        self.kind = np.dtype(kind)


def _tensor(stored: Any, offset: Any, shape: Any, strides: Any, *_: Any) -> Tensor:
    """The tensor of a call that torch writes; contiguous ones at the begin of their storage."""
    if not (isinstance(stored, tuple) and len(stored) == 5 and isinstance(stored[1], _Storage)):
        raise RefusedError("a tensor without a storage")
    if not (isinstance(shape, tuple) and isinstance(strides, tuple) and len(shape) < 9):
        raise RefusedError("a tensor of no shape")
    if not all(type(size) is int and 0 <= size < 1 << 40 for size in (*shape, *strides)):
        raise RefusedError("a tensor of no shape")
    expected = tuple(math.prod(shape[place + 1 :]) for place in range(len(shape)))
    if offset != 0 or strides != expected or not isinstance(stored[2], str):
        raise RefusedError("a tensor that is part of another")
    if math.prod(shape) * stored[1].kind.itemsize > MAX_ARRAY_BYTES:
        raise RefusedError(f"a tensor of {math.prod(shape)} numbers")
    return Tensor(stored[2], stored[1].kind, shape)


#: All globals that a torch file of one tensor needs.
_TORCH = {
    ("collections", "OrderedDict"): _Maker(lambda *items: dict(*items)),
    ("torch._utils", "_rebuild_tensor_v2"): _Maker(_tensor),
    ("torch._utils", "_rebuild_parameter"): _Maker(lambda data, *_: data),
    ("torch", "FloatStorage"): _Storage("<f4"),
    ("torch", "DoubleStorage"): _Storage("<f8"),
}


class _Torch(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        try:
            return _TORCH[module, name]
        except (KeyError, TypeError):
            raise RefusedError(f"{module}.{name}"[:80]) from None

    def persistent_load(self, pid: Any) -> Any:
        return pid


def loaded_tensor(data: bytes) -> Tensor:
    """The one tensor of the pickle in a torch file. Raises RefusedError for anything else, and any
    exception where it is damaged."""
    _scan(data, outside=_OUTSIDE - {"BINPERSID"})
    found = _Torch(io.BytesIO(data), encoding="latin1").load()
    if not isinstance(found, Tensor):
        raise RefusedError(f"a {type(found).__name__} in place of a tensor")
    return found


class _Arrays(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        try:
            return _ALLOWED[module, name]
        except (KeyError, TypeError):
            raise RefusedError(f"{module}.{name}"[:80]) from None


def load(path: Path) -> Any:
    """Content of a pickle of plain data. Raises ClipError, which names any other object."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ClipError(f"{path}: {path.stat().st_size} bytes; at most {MAX_BYTES} are read")
        data = read_bounded(path, MAX_BYTES)
    except OSError as error:
        raise ClipError(f"{path}: cannot be read ({error.strerror or error})") from error
    return _load(data, path)


def load_npy(path: Path) -> Any:
    """Content of a `.npy` file with one pickled object, as `load` returns it."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ClipError(f"{path}: {path.stat().st_size} bytes; at most {MAX_BYTES} are read")
        with path.open("rb") as file:
            version = np.lib.format.read_magic(file)
            reader = (
                np.lib.format.read_array_header_1_0
                if version == (1, 0)
                else np.lib.format.read_array_header_2_0
            )
            shape, _, kind = reader(file)
            rest = file.read()
    except ClipError:
        raise
    except Exception as error:  # a damaged header raises any exception
        raise ClipError(f"{path}: not a readable .npy file ({why(error, 120)})") from error
    if not kind.hasobject or shape != ():
        raise ClipError(f"{path}: holds an array {list(shape)} of {kind}, not a motion")
    return _load(rest, path)


def loaded(data: bytes) -> Any:
    """Content of a pickle of plain data; raises any exception where it is damaged."""
    _scan(data)
    return _whole(_Arrays(io.BytesIO(data), encoding="latin1").load(), {})


def _load(data: bytes, path: Path) -> Any:
    try:
        return loaded(data)
    except RefusedError as error:
        raise ClipError(
            f"{path}: refused: the pickle asks for {error}, and only numbers, text and numpy"
            " arrays of numbers are read"
        ) from error
    except Exception as error:  # a damaged pickle raises any exception
        raise ClipError(f"{path}: not a readable pickle ({why(error, 120)})") from error


def _scan(data: bytes, outside: frozenset[str] = _OUTSIDE) -> None:
    """Refuse opcodes that refer outside the file, and memo indices beyond the number of opcodes,
    for which the unpickler would allocate memory."""
    for steps, (opcode, argument, _) in enumerate(pickletools.genops(data), 1):
        if opcode.name in outside:
            raise RefusedError(f"{opcode.name}, which is outside the file")
        if opcode.name in _MEMO and isinstance(argument, int) and argument > steps:
            raise RefusedError(f"place {argument} of a memo of {steps}")


def _whole(value: Any, seen: dict[int, Any]) -> Any:
    """The value with all arrays resolved; each container once, however often it is referenced."""
    if isinstance(value, _Array):
        return _whole(value.content, seen)
    if isinstance(value, _Dtype | _Inert):
        return None
    if not isinstance(value, dict | list | tuple):
        return value
    if id(value) in seen:
        return seen[id(value)]
    if isinstance(value, dict):
        made: Any = {}
        seen[id(value)] = made
        made.update((key, _whole(one, seen)) for key, one in value.items())
    elif isinstance(value, list):
        made = seen[id(value)] = []
        made.extend(_whole(one, seen) for one in value)
    else:
        made = tuple(_whole(one, seen) for one in value)
        seen[id(value)] = made
    return made


def keys(content: Any, path: Path) -> tuple[str, ...]:
    """The keys of a dictionary. Raises ClipError for anything else."""
    if not isinstance(content, dict):
        raise ClipError(f"{path}: holds a {type(content).__name__}, not a motion's fields")
    return tuple(key for key in content if isinstance(key, str))


def numbers(value: Any) -> np.ndarray:
    """Numbers of a pickle as float64, from an array or nested lists. Raises ValueError otherwise.

    Lists that contain each other can hold more numbers than a file has bytes: they are counted
    first.
    """
    if isinstance(value, list | tuple):
        left = [MAX_LISTED]
        _counted(value, left, _MAX_DIMENSIONS)
    elif not isinstance(value, np.ndarray | np.generic | int | float):
        raise ValueError(f"a {type(value).__name__} in place of numbers")
    return np.asarray(value, dtype=np.float64)


def number(value: Any) -> float:
    """One number of a pickle, of any shape. Raises ValueError otherwise."""
    return npz.scalar(numbers(value))


def _counted(value: list | tuple, left: list[int], depth: int) -> None:
    if not depth:
        raise ValueError(f"lists more than {_MAX_DIMENSIONS} deep")
    for one in value:
        left[0] -= one.size if isinstance(one, np.ndarray) else 1
        if left[0] < 0:
            raise ValueError(f"more than {MAX_LISTED} numbers")
        if isinstance(one, list | tuple):
            _counted(one, left, depth - 1)
        elif not isinstance(one, np.ndarray | np.generic | int | float):
            raise ValueError(f"a {type(one).__name__} in place of a number")
