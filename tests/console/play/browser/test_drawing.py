"""Shapes are drawn at their size."""

import math

import numpy as np
import pytest

from console.play.browser.drawing import mesh_of


def test_shapes_are_drawn_at_their_size() -> None:
    upright = {"pos": [1.0, 2.0, 3.0], "quat": [1.0, 0.0, 0.0, 0.0]}
    capsule = mesh_of({"kind": "capsule", "size": [0.1, 0.3, 0.0], **upright})
    np.testing.assert_allclose(capsule.bounds, [[0.9, 1.9, 2.6], [1.1, 2.1, 3.4]], atol=2e-3)
    assert capsule.volume == pytest.approx(math.pi * (0.01 * 0.6 + 4 / 3 * 0.001), rel=0.08)
    ellipsoid = mesh_of({"kind": "ellipsoid", "size": [0.1, 0.2, 0.3], **upright})
    np.testing.assert_allclose(ellipsoid.bounds, [[0.9, 1.8, 2.7], [1.1, 2.2, 3.3]], atol=2e-3)
    assert ellipsoid.volume == pytest.approx(math.pi * 4 / 3 * 0.006, rel=0.03)
    half = math.sqrt(0.5)
    turned = {"pos": [0.0, 0.0, 0.0], "quat": [half, 0.0, 0.0, half]}
    box = mesh_of({"kind": "box", "size": [0.1, 0.2, 0.3], **turned})
    np.testing.assert_allclose(box.bounds[1], [0.2, 0.1, 0.3], atol=1e-9)
