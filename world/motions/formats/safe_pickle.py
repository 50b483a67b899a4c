"""Pickles read without running anything: numbers, text, containers and numpy arrays only."""

import io
import pickle
from pathlib import Path
from typing import Any

import numpy as np

from world.errors import ClipError

#: All that a pickle of arrays needs; everything else is refused by name.
_ALLOWED = {
    ("collections", "OrderedDict"),
    ("numpy", "ndarray"),
    ("numpy", "dtype"),
    ("numpy.core.multiarray", "_reconstruct"),
    ("numpy.core.multiarray", "scalar"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"),
    ("numpy.core.numeric", "_frombuffer"),
    ("numpy._core.numeric", "_frombuffer"),
    # protocol 2 writes bytes as encoded text
    ("_codecs", "encode"),
}


class _Refused(pickle.UnpicklingError):
    """A pickle that names something else than numbers."""


class _Arrays(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _ALLOWED:
            raise _Refused(f"{module}.{name}")
        return super().find_class(module, name)


def load(path: Path) -> Any:
    """What a pickle of plain data holds; ClipError names whatever else one asks for."""
    try:
        return _load(path.read_bytes(), path)
    except OSError as error:
        raise ClipError(f"{path}: cannot be read ({error})") from error


def load_npy(path: Path) -> Any:
    """What a `.npy` file of one pickled object holds, as `load` has it."""
    try:
        with path.open("rb") as file:
            version = np.lib.format.read_magic(file)
            reader = (
                np.lib.format.read_array_header_1_0
                if version == (1, 0)
                else np.lib.format.read_array_header_2_0
            )
            shape, _, kind = reader(file)
            rest = file.read()
    except (OSError, ValueError, EOFError) as error:
        raise ClipError(f"{path}: not a readable .npy file ({error})") from error
    if not kind.hasobject or shape != ():
        raise ClipError(f"{path}: holds an array {list(shape)} of {kind}, not a motion")
    held = _load(rest, path)
    return held.item() if isinstance(held, np.ndarray) and held.shape == () else held


def _load(data: bytes, path: Path) -> Any:
    # a list of bytes is as long as the file: nothing here grows beyond it but by memoised repeats
    try:
        return _Arrays(io.BytesIO(data), encoding="latin1").load()
    except _Refused as error:
        raise ClipError(
            f"{path}: refused: the pickle asks for {error}, and only numbers, text and numpy"
            " arrays are read"
        ) from error
    except Exception as error:  # a damaged pickle fails in any way there is
        text = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise ClipError(f"{path}: not a readable pickle ({text})") from error


def keys(content: Any, path: Path) -> tuple[str, ...]:
    """The keys of what should be a dictionary; ClipError otherwise."""
    if not isinstance(content, dict):
        raise ClipError(f"{path}: holds a {type(content).__name__}, not a motion's fields")
    return tuple(str(key) for key in content)
