"""A long table by hand."""

import numpy as np

from world.furniture import table


def test_a_long_table_by_hand() -> None:
    piece = table.build(table.Dimensions(height_m=0.74, depth_m=0.80, width_m=1.80))
    # the head 0.25 from the end of a top 1.80 long, whose middle is the origin
    assert piece.lie is not None
    assert np.allclose(piece.lie.head_m, (0.0, 0.65, 0.74))
    assert np.allclose(piece.lie.hip_m, (0.0, 0.65 - 0.635, 0.74))
    assert table.build(table.Dimensions(width_m=1.5)).lie is None
    assert table.build(table.Dimensions(width_m=1.8, depth_m=0.65)).lie is None
