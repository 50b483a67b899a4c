"""The clip cache gives back the same clips, and is made again where it must be."""

from pathlib import Path

import numpy as np
import pytest

from world.motions import cache
from world.motions.clip import Clip


def test_cache_gives_back_the_same_clips(
    tmp_path: Path, sitting: Clip, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    made = []

    def make() -> list[Clip]:
        made.append(1)
        return [sitting]

    first, second = cache.cached("k", make), cache.cached("k", make)
    assert len(made) == 1
    assert first[0].seat == second[0].seat == sitting.seat
    np.testing.assert_array_equal(second[0].local_rotation, sitting.local_rotation)
    (tmp_path / "inhabit" / "clips-k.npz").write_bytes(b"damaged")
    assert cache.cached("k", make)[0].name == sitting.name
    assert len(made) == 2
