"""Matrices and quaternions of the synthetic set."""

import numpy as np

from world.motions.synthetic import rotations


def test_quaternions_survive_the_way_to_matrices_and_back() -> None:
    generator = np.random.default_rng(3)
    q = generator.standard_normal((200, 4))
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    back = rotations.quaternion(rotations.matrix(q)[:, None])[:, 0]
    assert np.abs(np.abs(np.sum(q * back, -1)) - 1).max() < 1e-12
    vector = rotations.rotation_vector(q)
    assert np.linalg.norm(vector, axis=-1).max() <= np.pi + 1e-9
