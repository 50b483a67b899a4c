"""Heights of a piece from above."""

import numpy as np
import pytest

from world.furniture.affordance import seats
from world.furniture.affordance.relief import relief


def test_slats_are_closed_and_heights_are_read_between() -> None:
    slats = []
    for y in np.arange(-0.24, 0.25, 0.06):
        for x in (-0.25, 0.25):
            a, b = y - 0.015, y + 0.015
            slats.append([[-0.25, a, 0.44], [0.25, a, 0.44], [x, b, 0.44]])
    found = relief(np.array(slats))
    inside = found.height_m[5:-5, 5:-5]
    assert inside.min() == pytest.approx(0.44)
    assert (found.raw_m[5:-5, 5:-5] == 0.0).any()
    place = seats.find(found)[0]
    assert place.point_m[2] == pytest.approx(0.44, abs=1e-6)
