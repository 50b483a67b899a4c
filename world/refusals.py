"""One-line refusals of damaged files, for any failure of the reader."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from world.errors import ChoiceError, InhabitError

LONGEST = 300
"""Greatest number of characters of a reason in a message."""


@contextmanager
def refusing(kind: type[InhabitError], path: Path, what: str) -> Iterator[None]:
    """Context in which every failure is raised as a `kind` in one line with the path.

    A reader raises for the damage that it expects; parsers fail in unexpected ways too, which are
    caught here. Numpy's overflow warnings are failures of the file as well.
    """
    import numpy as np  # a tenth of a second, which the parsing of a command line does not need

    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (ChoiceError, MemoryError):
        raise  # not a fault of the file
    except InhabitError as error:
        text = one_line(error, 2000)
        if path.name in text and text == str(error):
            raise
        raise type(error)(text if path.name in text else f"{path}: {text}") from error
    except Exception as error:
        raise kind(f"{path}: not a readable {what} ({one_line(error)})") from error


def one_line(error: BaseException, longest: int = LONGEST) -> str:
    """An exception's text on one line, cut to `longest`; its type's name where it has none."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= longest else f"{text[:longest]}..."
