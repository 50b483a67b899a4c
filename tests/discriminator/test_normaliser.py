"""The discriminator's normaliser against numbers worked by hand."""

import math

import pytest
import torch

from discriminator import normaliser


def test_normaliser_is_fixed_floored_and_clipped() -> None:
    samples = torch.tensor([[1.0, 5.0], [3.0, 5.0]])
    mean, deviation = normaliser.fit(samples)
    assert mean.tolist() == [2.0, 5.0]
    assert deviation.tolist() == pytest.approx([1.0, 0.01])
    out = normaliser.normalise(torch.tensor([[2.5, 5.001], [-50.0, 9.0]]), mean, deviation)
    assert out.flatten().tolist() == pytest.approx([0.5, 0.1, -10.0, 10.0], abs=1e-4)


def test_a_tilt_that_no_clip_has_is_seen_coarsely() -> None:
    """0.23 rad, the median of boxes in hand, is beyond the clip of 10 deviations of 0.01."""
    tilt, yaw = torch.zeros(1000, 1), torch.linspace(-1.0, 1.0, 1000)[:, None]
    samples = torch.cat((tilt, tilt, yaw), dim=1)
    mean, deviation = normaliser.fit(samples, torch.tensor([False, True, True]))
    assert deviation.tolist() == pytest.approx([0.01, 0.2, 3.0**-0.5], abs=1e-3)
    found = normaliser.normalise(torch.full((1, 3), math.sin(0.23)), mean, deviation)[0]
    assert found.tolist() == pytest.approx([10.0, 1.14, 0.395], abs=5e-3)
