"""Steps: soles on the floor, and walks at their speed."""

import numpy as np
import pytest

from tests.support.world.synthetic import Posed
from world.motions.synthetic import gait, rotations, skeleton


@pytest.mark.parametrize("pitch_deg", [-20.0, 0.0, 15.0, 45.0])
def test_sole_touches_the_floor_at_every_pitch(pitch_deg: float) -> None:
    pitch = np.radians(pitch_deg)
    turned = rotations.about("y", pitch)
    corners = np.array([[skeleton.HEEL_M, 0, -0.05], [skeleton.TOE_M, 0, -0.05]])
    lowest = rotations.turn(turned, corners)[:, 2].min()
    assert gait.sole_drop(np.array(pitch), 0.0) == pytest.approx(-lowest)
    edge = corners[int(pitch > 0)]
    stays = gait.rocker_shift(np.array(pitch)) + rotations.turn(turned, edge)[0]
    assert pitch == 0 or stays == pytest.approx(edge[0])


@pytest.mark.parametrize("speed_m_s", [0.6, 0.8, 1.0, 1.2, 1.4, 1.6])
def test_walks_move_at_their_speed(speed_m_s: float, every: list[Posed]) -> None:
    clip = next(one.clip for one in every if one.clip.name == f"walk_{speed_m_s:.1f}")
    x = clip.root_position_m[4 * clip.fps : 7 * clip.fps, :2]
    assert np.linalg.norm(x[-1] - x[0]) / (len(x) - 1) * clip.fps == pytest.approx(
        speed_m_s, rel=0.08
    )
