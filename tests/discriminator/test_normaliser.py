"""The discriminator's normaliser against numbers worked by hand."""

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
