"""The page of axis conventions: its functions and numbers, on positions and rotations."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.support.paths import ROOT

PAGE = (ROOT / "docs/how-to/axes.md").read_text()
KNOWN: dict[str, Any] = {}
for _block in re.findall(r"```python\n(.+?)```", PAGE, re.DOTALL):
    exec(_block, KNOWN)
#: By engine: M, length unit in m, whether quaternions are scalar-first.
ENGINES = {
    "unity": (np.array([[0, -1, 0], [0, 0, 1], [1, 0, 0]]), 1.0, False),
    "unreal": (np.diag([1, -1, 1]), 0.01, False),
    "blender": (np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), 1.0, True),
}


def function(name: str) -> Callable[[Any], np.ndarray]:
    return lambda value: np.array(KNOWN[name](value), dtype=float)


def matrix(q: np.ndarray, scalar_first: bool = True) -> np.ndarray:
    """The matrix of a quaternion: the same formula in every engine, left-handed ones too."""
    w, x, y, z = q if scalar_first else np.roll(q, 1)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@pytest.mark.parametrize("engine", ENGINES)
def test_rotated_then_mapped_is_mapped_then_rotated(engine: str) -> None:
    m, unit_m, scalar_first = ENGINES[engine]
    random = np.random.default_rng(3)
    for _ in range(10):
        p, q, v = random.normal(size=3), random.normal(size=4), random.normal(size=3)
        q /= np.linalg.norm(q)
        there = function(f"{engine}_position")
        np.testing.assert_allclose(there(p), m @ p / unit_m, atol=1e-12)
        turned = matrix(function(f"{engine}_quaternion")(q), scalar_first)
        np.testing.assert_allclose(turned, m @ matrix(q) @ m.T, atol=1e-12)
        np.testing.assert_allclose(turned @ there(p), there(matrix(q) @ p), atol=1e-9)
        spin = function(f"{engine}_angular_velocity")(v)
        np.testing.assert_allclose(spin, np.linalg.det(m) * m @ v, atol=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_there_and_back(engine: str) -> None:
    p, q = np.array([0.3, -1.2, 0.9]), np.array([0.8, 0.36, -0.48, 0.0])
    back = function(f"from_{engine}_position")
    np.testing.assert_allclose(back(function(f"{engine}_position")(p)), p, atol=1e-12)
    back = function(f"from_{engine}_quaternion")
    np.testing.assert_allclose(back(function(f"{engine}_quaternion")(q)), q, atol=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_table_of_the_page(engine: str) -> None:
    row = re.search(rf"^\| {engine.title()} \| \((.+?)\) \| \((.+?)\) \|$", PAGE, re.MULTILINE)
    assert row
    position, quaternion = (np.array(cell.split(","), dtype=float) for cell in row.groups())
    np.testing.assert_allclose(function(f"{engine}_position")((1, 2, 3)), position, atol=1e-12)
    quarter = (np.sqrt(0.5), 0, 0, np.sqrt(0.5))
    np.testing.assert_allclose(function(f"{engine}_quaternion")(quarter), quaternion, atol=1e-4)


def test_forward_left_and_up_are_where_engines_have_them() -> None:
    expected = {
        "unity": [(0, 0, 1), (-1, 0, 0), (0, 1, 0)],
        "unreal": [(100, 0, 0), (0, -100, 0), (0, 0, 100)],
        "blender": [(0, -1, 0), (1, 0, 0), (0, 0, 1)],
    }
    for engine, axes in expected.items():
        for ours, theirs in zip(np.eye(3), axes, strict=True):
            np.testing.assert_allclose(function(f"{engine}_position")(ours), theirs, atol=1e-12)
