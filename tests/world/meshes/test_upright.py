"""Which way is up, and how large."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.world.meshes import TRIANGLES, written, y_up
from world.errors import ConfigError
from world.furniture.catalogue import find
from world.meshes import source
from world.meshes.frame import Frame
from world.meshes.upright import upright

CHAIR = find("chair-train-000")


def test_axes_units_and_height(tmp_path: Path) -> None:
    turned = source.read(written(tmp_path, ".obj", 100 * y_up(TRIANGLES)))
    frame = Frame(up="+y", front="+z", unit="cm")
    assert np.allclose(upright(turned, frame), TRIANGLES, atol=1e-5)
    tall = upright(turned, Frame("+y", "+z", height_m=1.0))
    assert np.allclose(tall, TRIANGLES / CHAIR.size_m[2], atol=1e-5)
    backwards = upright(turned, Frame("+y", "-z", "cm"))
    assert np.allclose(backwards[..., 0], -TRIANGLES[..., 0], atol=1e-5)
    with pytest.raises(ConfigError, match="two different axes"):
        upright(turned, Frame(up="+y", front="-y"))
