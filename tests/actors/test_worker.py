"""Rollouts against what the point shard must have done, and against other divisions of scenes."""

import time

import pytest
import torch

from actors.local import LocalFleet
from actors.worker import Worker
from policy.model.acting import Policy
from policy.model.networks import log_density
from tests.support.learning.points import assert_same, collect, fleet, weights
from tests.support.point_shard import (
    ACTION,
    EDGE,
    LIMIT,
    STATE,
    STRIDE,
    PointShard,
    next_goals,
)
from tests.support.successors import next_states
from world.precision import decide
from world.random_streams import normal


def test_rollout_obeys_the_dynamics():
    got = collect(2)
    assert got.states.shape == (41, 48, STATE) and got.actions.shape == (40, 48, ACTION)
    following = got.states[:-1, :, :2] + STRIDE * got.actions.clamp(-3, 3)
    torch.testing.assert_close(next_states(got)[..., :2], following)
    ended = got.fell | got.timed_out
    assert got.fell.any() and got.timed_out.any()
    assert got.end_index.tolist() == ended.nonzero().tolist()
    t, n = got.end_index.T
    # a fall ends outside the edge; the next episode starts inside it
    assert torch.equal(got.end_states[:, :2].norm(dim=-1) > EDGE, got.fell[t, n])
    assert (got.states[t + 1, n, :2].abs() <= 1).all()
    assert (got.episodes["length"] <= LIMIT).all()
    assert got.episodes["fall"].bool().tolist() == got.fell[t, n].tolist()
    target = next_states(got)[..., :2] + next_goals(got)
    error = (following - target).square().sum(-1)
    torch.testing.assert_close(got.rewards, torch.exp(-error), rtol=1e-4, atol=1e-5)


def test_actions_are_the_mean_and_the_streams_noise():
    got, policy = collect(2), Policy(weights(), decide("cpu"))
    for t in (0, 7):
        mean = torch.cat(
            [policy(got.states[t, i : i + 8], got.goals[t, i : i + 8]) for i in range(0, 48, 8)]
        )
        noise = normal(5, torch.arange(48), t, ACTION)
        assert torch.equal(got.means[t], mean)
        assert torch.equal(got.actions[t], mean + 0.2 * noise)
        assert torch.equal(got.log_probs[t], log_density(got.actions[t], mean, 0.2))


def test_a_scene_that_breaks_is_dropped_and_counted():
    got = collect(2, broken=(4, 11))
    assert (~got.valid).nonzero().tolist() == [[3, 11]]
    assert got.term_sums.isfinite().all()
    assert got.rewards[got.valid].isfinite().all()
    # its episode counts as none, and the others' keep their places
    assert [3, 11] not in got.end_index.tolist()
    assert got.episodes["return"].isfinite().all()
    t, n = got.end_index.T
    assert got.episodes["fall"].bool().tolist() == got.fell[t, n].tolist()


def test_term_sums_are_sums_over_time():
    got = collect(3)
    torch.testing.assert_close(got.term_sums[:, 0], got.rewards.double().sum(0))


def test_second_rollout_goes_on_where_the_first_ended_and_after_a_restore():
    held = fleet(2)
    first = held.collect(weights(), 0, 0.2)
    state = held.state_dict()
    second = held.collect(weights(), 1, 0.2)
    held.close()
    assert torch.equal(first.states[-1], second.states[0])
    other = fleet(2)
    other.load_state_dict(state)
    assert_same(second, other.collect(weights(), 1, 0.2))
    other.close()


def test_a_workers_error_surfaces():
    class Failing(PointShard):
        def step(self, action):
            if 8 in self.ids:
                raise RuntimeError("the scene burst")
            time.sleep(0.01)
            return super().step(action)

    held = LocalFleet(Failing, 24, 8, 3, seed=0, horizon=2)
    with pytest.raises(RuntimeError, match="the scene burst"):
        held.collect(weights(), 0, 0.1)
    held.close()


def test_the_shards_views_are_copied():
    class Views(PointShard):
        def observe(self):
            state, goal = super().observe()
            if not hasattr(self, "held"):
                self.held = (state.clone(), goal.clone())
            self.held[0].copy_(state)
            self.held[1].copy_(goal)
            return self.held

    one = Worker(Views(range(8), 5), range(8), 5, 8).rollout(weights(), 0, 10, 0.2)
    other = Worker(PointShard(range(8), 5), range(8), 5, 8).rollout(weights(), 0, 10, 0.2)
    assert_same(one, other)
