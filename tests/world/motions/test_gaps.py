"""Absent frames, by hand."""

import numpy as np
import pytest

from world.motions import gaps


def test_absent_frames_lie_between_their_neighbours() -> None:
    remarks: list[str] = []
    values = {"root": np.array([[0.0, 170.0], [1.0, 175.0], [4.0, -170.0]])}
    found = gaps.filled([1, 2, 5], values, {"root": (None, 360.0)}, remarks)
    np.testing.assert_allclose(found["root"][:, 0], [0, 1, 2, 3, 4])
    np.testing.assert_allclose(found["root"][:, 1], [170, 175, 180, 185, 190])
    assert remarks == ["2 absent frames are filled in between their neighbours"]


@pytest.mark.parametrize(
    ("numbers", "said"),
    [([1, 2, 3], ()), ([7, 8, 1], ()), ([0, 4, 8], ("steps of 4",)), ([5], ())],
)
def test_numbers_without_gaps_change_nothing(numbers: list[int], said: tuple[str, ...]) -> None:
    remarks: list[str] = []
    values = {"root": np.arange(len(numbers), dtype=float)[:, None]}
    assert gaps.filled(numbers, values, {"root": (None,)}, remarks) is values
    assert len(remarks) == len(said) and all(a in b for a, b in zip(said, remarks, strict=True))


def test_long_gaps_are_refused() -> None:
    values = {"root": np.zeros((3, 1))}
    with pytest.raises(ValueError, match="no frame between 2 and 16; gaps of at most 12"):
        gaps.filled([1, 2, 16], values, {"root": (None,)}, [])
