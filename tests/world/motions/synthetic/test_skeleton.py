"""The rest pose is the sum of the bones."""

import numpy as np
import pytest

from world.character import model as character
from world.motions.synthetic import skeleton


def test_rest_pose_is_the_sum_of_the_bones() -> None:
    local = np.tile(np.eye(3), (1, 15, 1, 1))
    positions, _ = skeleton.forward(np.array([[0.0, 0.0, 0.9]]), local)
    foot = positions[0, character.BODIES.index("left_foot")]
    assert foot == pytest.approx([0.0, 0.084887, 0.9 - 0.421546 - 0.40987])
    assert skeleton.MASSES_KG.sum() == pytest.approx(48.9)
