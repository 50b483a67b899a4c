"""Numbers of a message's fields: what passes, and what each refusal says."""

import math

import numpy as np
import pytest

from policy.errors import RequestError
from policy.fields import number, quaternion, upright, vector


def test_vectors_have_their_width_and_bounds() -> None:
    np.testing.assert_array_equal(vector([1.0, -2.0], "pose.x", 2), [1.0, -2.0])
    for values, bound, said in (
        ([1.0], 9.0, "pose.x: 1 numbers, must be 2"),
        ([1.0, 10.0], 9.0, "pose.x[1]: 10.0, must be within ±9"),
        ([math.nan, 0.0], 9.0, "pose.x[0]: nan, must be within ±9"),
        ([0.0, -math.inf], 9.0, "pose.x[1]: -inf, must be within ±9"),
    ):
        with pytest.raises(RequestError) as caught:
            vector(values, "pose.x", 2, bound)
        assert str(caught.value) == said


def test_numbers_within_their_bounds() -> None:
    assert number(0.2, "scale", 0.2, 5.0) == 0.2
    for wrong in (0.1, 5.1, math.nan):
        with pytest.raises(RequestError, match=r"^scale: .*, must be 0\.2 to 5$"):
            number(wrong, "scale", 0.2, 5.0)


def test_quaternions_come_to_unit_length() -> None:
    assert np.linalg.norm(quaternion([1.01, 0.0, 0.0, 0.0], "q")) == pytest.approx(1.0)
    with pytest.raises(RequestError, match=r"length 1\.030, must be a unit quaternion"):
        quaternion([1.03, 0.0, 0.0, 0.0], "q")


@pytest.mark.parametrize("yaw", [-3.0, -0.5, 0.0, 1.0, 3.1])
def test_the_yaw_of_what_stands_upright(yaw: float) -> None:
    half = yaw / 2
    assert upright([math.cos(half), 0.0, 0.0, math.sin(half)], "r") == pytest.approx(yaw)


def test_what_leans_is_refused() -> None:
    with pytest.raises(RequestError, match=r"tilted .* must be about z"):
        upright([math.cos(0.1), math.sin(0.1), 0.0, 0.0], "r")
