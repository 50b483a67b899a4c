"""Statistics of the last episodes against numbers worked by hand."""

import pytest
import torch

from learner.episodes import EpisodeWindow


def test_episode_window_by_hand():
    window = EpisodeWindow(3, ("near", "far", "never"))
    assert window.metrics() == {}
    rows = {"return": [9, 1, 2, 3], "length": [9, 10, 20, 30], "success": [1, 1, 0, 0]}
    rows |= {"fall": [0, 0, 1, 1], "start": [0, 0, 1, 1]}
    window.add({key: torch.tensor(values) for key, values in rows.items()})
    found = window.metrics()
    assert (found["episode/return"], found["episode/length"]) == (2.0, 20.0)
    assert found["episode/success"] == pytest.approx(1 / 3)
    assert (found["episode/success_near"], found["episode/success_far"]) == (1.0, 0.0)
    assert "episode/success_never" not in found
