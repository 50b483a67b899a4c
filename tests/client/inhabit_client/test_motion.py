"""Kinematics of the client against scipy's rotations and by hand."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from inhabit_client import messages
from inhabit_client.motion import frame_of, local_rotations, product, turned

BODIES = [
    messages.Body(name="pelvis", parent=-1, offset=[0, 0, 0]),
    messages.Body(name="shin", parent=0, offset=[0, 0, -1]),
]


def test_quaternions() -> None:
    a, b = (Rotation.random(20, random_state=seed) for seed in (0, 1))
    one, two = (r.as_quat(scalar_first=True) for r in (a, b))
    wanted = (a * b).as_quat(scalar_first=True)
    assert np.abs(np.abs(np.sum(product(one, two) * wanted, axis=1)) - 1).max() < 1e-12
    vector = np.random.default_rng(0).normal(size=(20, 3))
    np.testing.assert_allclose(turned(one, vector), a.apply(vector), atol=1e-12)


def test_a_hinge_turns_about_its_axis() -> None:
    joints = [messages.Joint(name="knee", body="shin", kind="hinge", axis=[0, 1, 0])]
    found = local_rotations(np.array([1.0, 0, 0, 0]), np.array([np.pi / 2]), BODIES, joints)
    np.testing.assert_allclose(found[1], (np.sqrt(0.5), 0, np.sqrt(0.5), 0))
    np.testing.assert_allclose(found[0], (1, 0, 0, 0))


def test_a_frame_that_does_not_fit_is_refused() -> None:
    header = messages.SynthesisHeader(bodies=BODIES)
    joint = header.joints.add(name="hip", body="shin", kind="ball")
    assert joint.kind == "ball"
    frame = messages.Frame(root_position=[0, 0, 1], root_rotation=[1, 0, 0, 0],
                           joint_position=[1, 0, 0])  # fmt: skip
    with pytest.raises(ValueError, match="3 positions of joints, not 4"):
        frame_of(frame, header)
