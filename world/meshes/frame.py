"""Axes and size of a mesh file: its rotation and unit to the piece's frame."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from world.errors import ConfigError

Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Unit = Literal["m", "cm", "mm", "in", "ft"]

METRES: dict[Unit, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}


@dataclass(frozen=True)
class Frame:
    """Axes and size of a file's mesh; None: the format's convention."""

    up: Axis | None = None
    front: Axis | None = None
    unit: Unit | None = None
    height_m: float | None = None
    """Scale to this height instead of by a unit."""
    size_m: tuple[float, float, float] | None = None
    """Scale to this box (x, y, z in the piece's frame), from a catalogue."""


def default_up(suffix: str) -> Axis:
    """The upward axis of a format: glTF defines it; z for the others."""
    return "+y" if suffix in (".glb", ".gltf") else "+z"


def turn(suffix: str, frame: Frame) -> NDArray[np.float64]:
    """Rotation [3, 3] from the file's axes to the piece's. Raises ConfigError."""
    up = frame.up or default_up(suffix)
    # glTF defines +z as the front; it is the convention of other formats with y up, too
    front = frame.front or ("+z" if up[1] == "y" else "+x" if up[1] == "z" else "+y")
    if up[1] == front[1]:
        raise ConfigError(f"--up {up} --front {front}: choose two different axes")
    x, z = _axis(front), _axis(up)
    return np.stack((x, np.cross(z, x), z))


def _axis(name: str) -> NDArray[np.float64]:
    axis = np.zeros(3)
    axis["xyz".index(name[1])] = 1.0 if name[0] == "+" else -1.0
    return axis
