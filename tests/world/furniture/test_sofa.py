"""Sofas have a place for everyone."""

from world.furniture import sofa


def test_sofas_have_a_place_for_everyone() -> None:
    assert len(sofa.build(sofa.Dimensions(clear_width_m=1.9)).sit) == 3
    assert len(sofa.build(sofa.Dimensions(clear_width_m=1.5)).sit) == 2
    corner = sofa.build(sofa.Dimensions(clear_width_m=1.9, arms="corner", base="plinth"))
    # no one sits where the chaise is in front of the knees
    assert all(p.point_m[1] > -0.95 + 0.68 for p in corner.sit)
    assert corner.size_m[0] > sofa.build(sofa.Dimensions()).size_m[0] + 0.5
