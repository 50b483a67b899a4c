"""Axes of mesh files."""

import numpy as np
import pytest

from world.errors import ConfigError
from world.meshes.frame import Axis, Frame, turn


@pytest.mark.parametrize(
    ("suffix", "frame", "front", "up"),
    [
        (".obj", Frame(), (1, 0, 0), (0, 0, 1)),
        (".glb", Frame(), (0, 0, 1), (0, 1, 0)),
        (".obj", Frame(up="+y"), (0, 0, 1), (0, 1, 0)),
        (".stl", Frame(up="-x"), (0, 1, 0), (-1, 0, 0)),
        (".ply", Frame(up="+z", front="-y"), (0, -1, 0), (0, 0, 1)),
    ],
)
def test_front_and_up_become_x_and_z(
    suffix: str, frame: Frame, front: tuple[int, ...], up: tuple[int, ...]
) -> None:
    rotation = turn(suffix, frame)
    assert np.allclose(rotation @ front, (1, 0, 0))
    assert np.allclose(rotation @ up, (0, 0, 1))
    assert np.linalg.det(rotation) == pytest.approx(1.0)


@pytest.mark.parametrize("axis", ["+x", "-y"])
def test_two_axes_are_different(axis: Axis) -> None:
    with pytest.raises(ConfigError, match="choose two different axes"):
        turn(".obj", Frame(up=axis, front=axis))
