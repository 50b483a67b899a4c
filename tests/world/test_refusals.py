"""Every failure of a reader is one line that names the file."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from world.errors import ChoiceError, ClipError, PieceError
from world.refusals import LONGEST, one_line, reason, refusing, why

PATH = Path("some/folder/a.npz")


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (KeyError("fps"), "some/folder/a.npz: not a readable clip ('fps' is missing)"),
        (ValueError("two\n  lines"), "some/folder/a.npz: not a readable clip (two lines)"),
        (RecursionError(), "some/folder/a.npz: not a readable clip (it is nested too deeply)"),
        (ClipError("fps is 0"), "some/folder/a.npz: fps is 0"),
        (ClipError("a.npz: fps is 0"), "a.npz: fps is 0"),
    ],
)
def test_what_a_reader_raises_becomes_one_line(error: Exception, said: str) -> None:
    with pytest.raises(ClipError) as caught, refusing(ClipError, PATH, "clip"):
        raise error
    assert str(caught.value) == said


def test_errors_of_the_project_keep_their_kind() -> None:
    with pytest.raises(PieceError, match=r"a\.npz: no boxes"), refusing(ClipError, PATH, "clip"):
        raise PieceError("no boxes")
    for error in (ChoiceError("format", "x", ["bvh"]), MemoryError()):
        with pytest.raises(type(error)) as caught, refusing(ClipError, PATH, "clip"):
            raise error
        assert caught.value is error


def python(text: str, **names: object) -> Exception:
    """What Python or numpy raises for an expression."""
    try:
        eval(text, {"np": np, "json": json, "struct": struct, **names})
    except Exception as error:
        return error
    raise AssertionError(text)


@pytest.mark.parametrize(
    ("expression", "said"),
    [
        ("{}['accessors']", "'accessors' is missing"),
        ("[][3]", "a number that points beyond its list"),
        ("[].get('a')", "a value of another kind than the format's"),
        ("None['a']", "a value of another kind than the format's"),
        ("1 + 'a'", "a value of another kind than the format's"),
        ("int('a1')", "'a1' is no whole number"),
        ("float('a1')", "'a1' is no number"),
        ("json.loads('{\\n]')", "its JSON is damaged at line 2, column 1"),
        ("b'\\xff'.decode()", "its text is not UTF-8"),
        ("struct.unpack('<4i', b'')", "it is cut short"),
        ("np.frombuffer(b'123', 'f4')", "it is cut short"),
        ("np.zeros(5).reshape(2, 2)", "5 numbers where others are stated"),
        ("np.zeros(5) + np.zeros(4)", "arrays of sizes that differ"),
        ("np.array([[1], [1, 2]])", "lists of lengths that differ"),
        ("[0 for a, b in [(1, 2, 3)]]", "a list of another length than the format's"),
        ("float('1') ** 1e6 if 0 else (10.0 ** 400)", "a number too large"),
    ],
)
def test_an_exception_of_python_is_said_in_words_of_the_file(expression: str, said: str) -> None:
    assert reason(python(expression)) == said


def test_what_a_reader_says_itself_stays() -> None:
    assert reason(ValueError("an accessor beyond its buffer")) == "an accessor beyond its buffer"
    assert reason(ClipError("fps is 0")) == "fps is 0"
    assert reason(FileNotFoundError(2, "No such file", "a")) == "[Errno 2] No such file: 'a'"


def test_long_texts_are_cut() -> None:
    assert one_line(ValueError("x" * 999)) == why(ValueError("x" * 999)) == "x" * LONGEST + "..."
    assert one_line(IndexError("at\n7")) == "at 7"  # of the program, not of a file
