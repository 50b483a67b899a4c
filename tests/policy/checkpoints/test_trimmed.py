"""A trimmed checkpoint: the scenes are left out, the replay is cut, the rest stays whole."""

import pytest
import torch

from policy.checkpoints.trimmed import trimmed
from policy.errors import CheckpointError

STATE = {
    "policy": {"actor": torch.ones(10)},
    "training": {"iteration": 7, "fleet": torch.zeros(1000), "waiting": torch.zeros(1000)},
    "style": {"network": torch.ones(5), "replay": torch.rand(100, 3), "counters/replay": 100},
}


def test_scenes_are_left_out_and_the_replay_is_cut() -> None:
    small = trimmed(STATE, 60 + 25 * 12 + 11)
    assert small["training"] == {"iteration": 7}
    assert torch.equal(small["style"]["replay"], STATE["style"]["replay"][:25])
    assert int(small["style"]["counters/replay"]) == 25
    assert small["policy"] is STATE["policy"]
    # nothing of the original is changed
    assert len(STATE["style"]["replay"]) == 100 and "fleet" in STATE["training"]


def test_no_window_goes_on_from_an_episode_that_is_left_out() -> None:
    past, age = torch.rand(8, 16, 3), torch.full((16,), 8)
    state = {**STATE, "style": STATE["style"] | {"past": past, "age": age}}
    style = trimmed(state, 10_000)["style"]
    assert style["past"].shape == (8, 0, 3) and style["age"].shape == (0,)
    assert len(state["style"]["age"]) == 16


def test_where_everything_fits_nothing_is_cut() -> None:
    found = trimmed(STATE, 10_000)
    assert torch.equal(found["style"]["replay"], STATE["style"]["replay"])


def test_networks_that_do_not_fit_are_refused() -> None:
    with pytest.raises(CheckpointError, match="the networks and their optimisers alone take"):
        trimmed(STATE, 50)
