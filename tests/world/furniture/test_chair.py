"""A chair by hand."""

import numpy as np
import pytest

from world.errors import ChoiceError
from world.furniture import armchair, chair, stool
from world.furniture.catalogue import catalogue


def test_unknown_styles_name_the_choices():
    with pytest.raises(ChoiceError, match="cantilever"):
        chair.build(chair.Dimensions(base="wheels"))
    with pytest.raises(ChoiceError, match="splat"):
        chair.build(chair.Dimensions(back="none"))
    with pytest.raises(ChoiceError, match="swivel"):
        armchair.build(armchair.Dimensions(style="rocking"))
    with pytest.raises(ChoiceError, match="braced"):
        stool.build(stool.Dimensions(base="wheels"))
    with pytest.raises(ChoiceError, match="furniture class 'throne'"):
        catalogue("train", 4, classes=("throne",))


def test_a_chair_by_hand():
    plain = chair.Dimensions(
        seat_height_m=0.4,
        seat_depth_m=0.4,
        seat_width_m=0.5,
        seat_tilt_deg=0.0,
        back_height_m=0.5,
        back_thickness_m=0.04,
        recline_deg=0.0,
        pelvis_from_back_m=0.18,
    )
    piece = chair.build(plain)
    # Depth 0.40 + 0.04 behind; the origin is 0.22 from the front edge, 0.18 from the back's face.
    assert np.allclose(piece.size_m, (0.44, 0.5, 0.9))
    assert np.allclose(piece.sit[0].point_m, (0.0, 0.0, 0.4))
    assert len(piece.boxes) == 6
