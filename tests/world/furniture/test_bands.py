"""Bands of dimensions by hand."""

from itertools import pairwise

import numpy as np

from world.furniture.bands import cells


def test_cells_by_hand():
    # (0, 5): cells of 1, a tenth left out at each end, dealt train, test, train, test, train.
    assert np.allclose(cells((0.0, 5.0), "train"), [(0.1, 0.9), (2.1, 2.9), (4.1, 4.9)])
    assert np.allclose(cells((0.0, 5.0), "test"), [(1.1, 1.9), (3.1, 3.9)])
    spans = sorted(cells((0.38, 0.48), "train") + cells((0.38, 0.48), "test"))
    assert all(a[1] < b[0] for a, b in pairwise(spans))
