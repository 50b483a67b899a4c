"""Names of joints in use are known."""

import pytest

from world.motions.formats import landmarks


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (
            ("mixamorig:LeftUpLeg", "mixamorig:LeftLeg", "mixamorig:LeftFoot"),
            ("left", "upleg"),
        ),
        (("lfemur", "ltibia", "lfoot"), ("left", "femur")),
        (("thigh.L", "shin.L", "foot.L"), ("left", "thigh")),
        (("L_Hip", "L_Knee", "L_Ankle"), ("left", "hip")),
        (("Bip01 L Thigh", "Bip01 L Calf", "Bip01 L Foot"), ("left", "thigh")),
    ],
)
def test_names_in_use_are_known(names: tuple[str, ...], expected: tuple[str, str]) -> None:
    assert landmarks._plain(names[0]) == expected
    assert [landmarks._plain(n)[0] for n in names] == ["left"] * 3
