"""Damaged files refused in one line that names them, however the reader of the format fails."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from world.errors import ChoiceError, InhabitError

LONGEST = 300
"""Characters of a reason that are shown."""


@contextmanager
def refusing(kind: type[InhabitError], path: Path, what: str) -> Iterator[None]:
    """Within it, every failure is a `kind` in one line with the path in it.

    A reader expects the damages that it can name. A parser fails in more ways than are known, so
    that what is left is caught here. Numpy's warnings of overflow are those of the file, too.
    """
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (ChoiceError, MemoryError):
        raise  # say nothing of the file
    except InhabitError as error:
        text = one_line(error, 2000)
        if path.name in text and text == str(error):
            raise
        raise type(error)(text if path.name in text else f"{path}: {text}") from error
    except Exception as error:
        raise kind(f"{path}: not a readable {what} ({one_line(error)})") from error


def one_line(error: BaseException, longest: int = LONGEST) -> str:
    """An exception's text on one line, cut to a length; its type's name where it has none."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= longest else f"{text[:longest]}..."
