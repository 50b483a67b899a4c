"""Every failure of a reader is one line that names the file."""

from pathlib import Path

import pytest

from world.errors import ChoiceError, ClipError, PieceError
from world.refusals import LONGEST, one_line, refusing

PATH = Path("some/folder/a.npz")


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (KeyError("fps"), "some/folder/a.npz: not a readable clip ('fps')"),
        (ValueError("two\n  lines"), "some/folder/a.npz: not a readable clip (two lines)"),
        (RecursionError(), "some/folder/a.npz: not a readable clip (RecursionError)"),
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


def test_long_texts_are_cut() -> None:
    assert one_line(ValueError("x" * 999)) == "x" * LONGEST + "..."
