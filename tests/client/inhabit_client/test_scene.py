"""Messages of scenes by hand."""

import math
from pathlib import Path

import numpy as np
import pytest

from inhabit_client import box, furniture, messages, pose, situation


def test_furniture_is_named_or_a_mesh_or_a_shape(tmp_path: Path) -> None:
    named = furniture("chair-test-000", (1, 2, math.pi / 2), 1.1, 1)
    assert (named.piece, named.place) == ("chair-test-000", 1)
    np.testing.assert_allclose(named.rotation, (math.sqrt(0.5), 0, 0, math.sqrt(0.5)), atol=1e-6)
    assert list(named.position) == [1, 2, 0] and named.scale == pytest.approx(1.1)
    file = tmp_path / "a.GLB"
    file.write_bytes(b"glTF")
    assert furniture(file).mesh == messages.Mesh(format="glb", data=b"glTF")
    shape = messages.Shape(hip=[0, 0, 0.4])
    assert furniture(shape).custom == shape
    with pytest.raises(ValueError, match=r"a\.fbx: no mesh of \.obj"):
        furniture(Path("a.fbx"))


def test_a_box_rests_where_it_starts() -> None:
    made = box((1, 2, 0.75), (3, 0, 0.9), mass_kg=2.0)
    assert list(made.start) == list(made.position) == [1, 2, 0.75]
    assert made.mass_kg == 2.0 and not any(made.velocity)
    assert not box((0, 0, 1), (1, 0, 1)).HasField("mass_kg")
    assert situation(messages.Pose(), made).HasField("box")


def test_a_pose_is_at_rest_unless_it_moves() -> None:
    made = pose(np.zeros(3), [1, 0, 0, 0], np.zeros(36))
    assert len(made.joint_velocity) == 28 and not any(made.root_velocity)
    with pytest.raises(ValueError, match=r"joint_position: must be \[36\], is \[3\]"):
        pose(np.zeros(3), [1, 0, 0, 0], np.zeros(3))
