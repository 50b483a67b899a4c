"""One-line refusals of damaged files, for any failure of the reader, in words of the file."""

import json
import re
import struct
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
        raise kind(f"{path}: not a readable {what} ({why(error)})") from error


def unknown_suffix(path: Path) -> str:
    """What is wrong with a path whose suffix is none of those that are known."""
    return f"unknown suffix '{path.suffix}'" if path.suffix else "no suffix"


def one_line(error: BaseException, longest: int = LONGEST) -> str:
    """An exception's text on one line, cut to `longest`; its type's name where it has none."""
    return _cut(str(error), error, longest)


def why(error: BaseException, longest: int = LONGEST) -> str:
    """The `reason` of a file's reader on one line, cut to `longest`."""
    return _cut(reason(error), error, longest)


def _cut(text: str, error: BaseException, longest: int) -> str:
    text = " ".join(text.split()) or type(error).__name__
    return text if len(text) <= longest else f"{text[:longest]}..."


#: Texts of Python and numpy for a value of another kind or size, and what they mean for the file.
_TEXTS = (
    (r"invalid literal for int\(\) with base \d+: (.*)", r"\1 is no whole number"),
    (r"could not convert string to float: (.*)", r"\1 is no number"),
    (r"cannot reshape array of size (\d+) into shape .*", r"\1 numbers where others are stated"),
    (r"(?:not enough|too many) values to unpack.*", "a list of another length than the format's"),
    (r"buffer (?:is smaller|size must be) .*", "it is cut short"),
    (r"operands could not be broadcast.*|all the input arrays? .*", "arrays of sizes that differ"),
    (r"setting an array element with a sequence.*", "lists of lengths that differ"),
    (r"count must be .*|negative dimensions .*", "a negative number of elements"),
)


def reason(error: BaseException) -> str:
    """Why a file cannot be read, in words of the file: an exception that a parser did not expect
    tells of the program alone."""
    text = str(error)
    if isinstance(error, InhabitError | OSError):
        return text
    if isinstance(error, json.JSONDecodeError):
        return f"its JSON is damaged at line {error.lineno}, column {error.colno}"
    if isinstance(error, UnicodeDecodeError):
        return f"its text is not {error.encoding.upper()}"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    if isinstance(error, OverflowError):
        return "a number too large"
    if isinstance(error, struct.error):
        return "it is cut short"
    if isinstance(error, KeyError):
        return f"{error.args[0]!r} is missing" if error.args else "a part is missing"
    if isinstance(error, IndexError):
        return "a number that points beyond its list"
    if isinstance(error, TypeError | AttributeError):
        return "a value of another kind than the format's"
    for python, plain in _TEXTS:
        if found := re.fullmatch(python, text, re.DOTALL):
            return found.expand(plain)
    return text
