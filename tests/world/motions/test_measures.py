"""Measures of clips: breaks are named by their time."""

from dataclasses import replace

import pytest

from world.motions import measures
from world.motions.clip import Clip


def test_every_break_is_named_by_its_time(imported: Clip) -> None:
    assert measures.discontinuities(imported) == []
    root = imported.root_position_m.copy()
    root[20:] += [0.5, 0, 0]
    turned = imported.local_rotation.copy()
    turned[45:, 9] = [0.0, 1.0, 0.0, 0.0]
    broken = replace(imported, root_position_m=root, local_rotation=turned)
    first, second = measures.discontinuities(broken)
    assert first == pytest.approx(19.5 / 30, abs=0.05)
    assert second == pytest.approx(44.5 / 30, abs=0.05)
