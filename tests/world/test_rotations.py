"""Rotations against scipy's."""

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from world import rotations


def sample(n: int = 200, seed: int = 0) -> tuple[torch.Tensor, Rotation]:
    turn = Rotation.random(n, np.random.default_rng(seed))
    return quaternions(turn), turn


def quaternions(turn: Rotation) -> torch.Tensor:
    return torch.from_numpy(np.atleast_2d(np.roll(turn.as_quat(), 1, axis=-1)))


def test_product_and_matrix() -> None:
    a, ra = sample(seed=1)
    b, rb = sample(seed=2)
    product = Rotation.from_quat(np.roll(rotations.multiply(a, b).numpy(), -1, axis=1))
    np.testing.assert_allclose((product * (ra * rb).inv()).magnitude(), 0, atol=1e-7)
    np.testing.assert_allclose(rotations.matrix(a).numpy(), ra.as_matrix(), atol=1e-12)
    unit = rotations.multiply(a, rotations.conjugate(a))
    np.testing.assert_allclose(unit.numpy(), np.eye(4)[[0] * 200], atol=1e-12)


def test_rotation_vectors() -> None:
    q, turn = sample()
    np.testing.assert_allclose(rotations.to_rotation_vector(q).numpy(), turn.as_rotvec(), atol=1e-9)
    tiny = np.array([[1e-9, 0.0, -2e-9], [0.0, 0.0, 0.0]])
    found = rotations.to_rotation_vector(quaternions(Rotation.from_rotvec(tiny)))
    np.testing.assert_allclose(found.numpy(), tiny, atol=1e-15)


def test_heading() -> None:
    yaw = torch.linspace(-3, 3, 25, dtype=torch.float64)
    zero = torch.zeros_like(yaw)
    upright = quaternions(Rotation.from_rotvec(torch.stack((zero, zero, yaw), 1).numpy()))
    found = rotations.heading(upright)
    np.testing.assert_allclose(found[:, 0].numpy(), np.cos(yaw), atol=1e-12)
    np.testing.assert_allclose(found[:, 1].numpy(), np.sin(yaw), atol=1e-12)
    # leaning back, even to lying, keeps the heading: pitch is a swing
    for pitch in (0.3, -1.0, -np.pi / 2):
        tilt = quaternions(Rotation.from_rotvec([0.0, pitch, 0.0]))
        leaning = rotations.multiply(upright, tilt.expand(25, 4))
        np.testing.assert_allclose(rotations.heading(leaning).numpy(), found.numpy(), atol=1e-12)
    # upside down has none: defined, finite
    flipped = torch.tensor([[0.0, 1.0, 0.0, 0.0]])
    assert rotations.heading(flipped).tolist() == [[1.0, 0.0]]


def test_turn_and_back() -> None:
    cs = torch.tensor([[0.6, 0.8]])
    v = torch.tensor([[1.0, 0.0, 5.0]])
    assert rotations.turn(cs, v)[0].tolist() == [0.6000000238418579, 0.800000011920929, 5.0]
    torch.testing.assert_close(rotations.turn_back(cs, rotations.turn(cs, v)), v)


def test_angles_and_their_cosines_and_sines() -> None:
    angle = torch.tensor([[0.0, 0.5], [-3.0, 2.5]], dtype=torch.float64)
    found = rotations.cos_sin(angle)
    expected = np.stack((np.cos(angle.numpy()), np.sin(angle.numpy())), axis=-1)
    np.testing.assert_allclose(found.numpy(), expected)
    torch.testing.assert_close(rotations.yaw(found), angle)
