"""A checkpoint's layout, manifest and state, and their comparison."""

import torch

from policy.checkpoints.format import Layout, Manifest

LAYOUT = Layout("sit", (("root_height", 1), ("root_rotation", 6)), (("target", 3),), 28, (8, 4))
MANIFEST = Manifest(LAYOUT, iteration=12, samples=999, notes={"data": "SAMP", "licence": "CC"})


def state() -> dict:
    generator = torch.Generator().manual_seed(0)
    shared = torch.randn(6, 4, generator=generator)
    return {
        "policy": {"actor": {"w": shared, "view": shared[:, 1]}, "same": shared},
        "training": {
            "learner": {"samples": 999, "rate": 0.1 + 0.2, "nothing": None, "empty": {}},
            "clock": torch.tensor(5),
            "mask": torch.tensor([True, False]),
            "ends": [0, 64, 128],
            "network/0": torch.ones(2),
            "a~1b": {"/": 1, "~": 2},
        },
        "style": {},
    }


def assert_same(one, other) -> None:
    assert type(one) is type(other)
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            assert_same(one[key], other[key])
    elif isinstance(one, torch.Tensor):
        assert one.dtype == other.dtype and torch.equal(one, other)
    else:
        assert one == other
