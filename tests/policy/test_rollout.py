"""Joining rollouts and pairing states with their true successors."""

import pytest
import torch

from policy.rollout import Rollout
from tests.support.successors import next_states


def rollout(first: int, scenes: int, ends: list[tuple[int, int]], horizon: int = 3) -> Rollout:
    """A rollout whose numbers say where they belong: state = 100 t + global scene."""
    ids = torch.arange(first, first + scenes)
    times = torch.arange(horizon + 1)
    state = (100 * times[:, None] + ids[None, :]).float()[..., None]
    shape = (horizon, scenes)
    end = torch.tensor(ends, dtype=torch.int64).reshape(-1, 2)
    ended = (-(100 * end[:, 0] + first + end[:, 1]).float())[:, None]
    return Rollout(
        states=state,
        goals=state,
        actions=state[:-1],
        means=state[:-1],
        log_probs=state[:-1, :, 0],
        rewards=state[:-1, :, 0],
        term_sums=ids[:, None].double(),
        fell=torch.zeros(shape, dtype=torch.bool),
        timed_out=torch.zeros(shape, dtype=torch.bool),
        valid=torch.ones(shape, dtype=torch.bool),
        end_index=end,
        end_states=ended,
        end_goals=ended,
        episodes={"return": ended[:, 0]},
        version=7,
        first_scene=first,
        seconds={"world": float(first), "policy": 1.0},
    )


def test_join_is_in_scene_order_whatever_the_order_of_the_parts():
    parts = [rollout(4, 2, [(0, 1), (2, 0)]), rollout(0, 4, [(0, 3), (1, 2)])]
    joined = Rollout.join(parts)
    assert joined.states[1, :, 0].tolist() == [100, 101, 102, 103, 104, 105]
    assert joined.end_index.tolist() == [[0, 3], [0, 5], [1, 2], [2, 4]]
    assert joined.end_states[:, 0].tolist() == [-3, -5, -102, -204]
    assert joined.episodes["return"].tolist() == [-3, -5, -102, -204]
    assert (joined.version, joined.first_scene, joined.scenes, joined.samples) == (7, 0, 6, 18)
    assert joined.seconds == {"world": 4.0, "policy": 1.0}


def test_join_does_not_depend_on_the_division():
    ends = [(0, 5), (1, 1), (1, 4)]
    whole = Rollout.join([rollout(0, 6, ends)])
    halves = Rollout.join([rollout(0, 3, [(1, 1)]), rollout(3, 3, [(0, 2), (1, 1)])])
    for name, tensor in whole.tensors().items():
        assert torch.equal(tensor, halves.tensors()[name]), name


def test_scenes_that_are_missing_or_twice_there_are_no_rollout():
    for second in (2, 4):
        with pytest.raises(ValueError, match=f"scene {second} follows 2"):
            Rollout.join([rollout(0, 3, []), rollout(second, 3, [])])


def test_successors_cross_no_reset():
    found = next_states(rollout(0, 2, [(1, 0)]))
    # scene 0 ended at t = 1: its successor there is the last state, not the next episode's first
    assert found[..., 0].tolist() == [[100, 101], [-100, 201], [300, 301]]


def test_term_means_count_valid_samples_only():
    one = rollout(0, 2, [])
    one.valid[0, 0] = False
    assert one.term_means(["x"]) == {"x": (0 + 1) / 5}
