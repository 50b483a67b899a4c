"""Counter-based draws: their distribution, their independence, and that sharding changes none."""

import numpy as np
import torch
from scipy import stats

from world import random_streams


def test_same_counter_same_numbers_in_any_batch() -> None:
    ids = torch.arange(512)
    whole = random_streams.normal(3, ids, 17, 28)
    parts = torch.cat(
        [random_streams.normal(3, ids[i : i + 64], 17, 28) for i in range(0, 512, 64)]
    )
    assert torch.equal(whole, parts)
    assert not torch.equal(whole, random_streams.normal(3, ids, 18, 28))
    assert not torch.equal(whole, random_streams.normal(4, ids, 17, 28))


def test_uniform_and_normal() -> None:
    u = random_streams.uniform(0, 5, torch.arange(4096), 1, 16)
    assert u.min() >= 0
    assert u.max() < 1
    assert stats.kstest(u.flatten().numpy(), "uniform").pvalue > 0.01
    x = random_streams.normal(0, torch.arange(4096), 1, 15)
    assert stats.kstest(x.flatten().numpy(), "norm").pvalue > 0.01


def test_neighbours_are_independent() -> None:
    u = random_streams.uniform(0, 5, torch.arange(2000), 1, 8).numpy()
    by_counter = np.stack(
        [random_streams.uniform(0, 5, torch.arange(2000), k, 1)[:, 0].numpy() for k in range(8)],
        axis=1,
    )
    for table in (u, by_counter):
        correlation = np.corrcoef(table.T) - np.eye(8)
        assert np.abs(correlation).max() < 0.08
        shifted = np.corrcoef(table[1:, 0], table[:-1, 0])[0, 1]
        assert abs(shifted) < 0.08


def test_counters_may_differ_by_scene() -> None:
    ids, counters = torch.tensor([5, 9]), torch.tensor([2, 7])
    both = random_streams.uniform(1, 2, ids, counters, 4)
    assert torch.equal(both[:1], random_streams.uniform(1, 2, ids[:1], 2, 4))
    assert torch.equal(both[1:], random_streams.uniform(1, 2, ids[1:], 7, 4))


def test_no_two_purposes_share_a_key() -> None:
    keys = [v for k, v in vars(random_streams).items() if k.isupper() and k[0] != "_"]
    assert len(keys) == len(set(keys)) == 10
    u = [random_streams.uniform(0, key, torch.arange(4), 0, 2) for key in keys]
    assert len({tuple(x.flatten().tolist()) for x in u}) == len(keys)


def test_weighted_draws_miss_a_weight_of_zero_and_follow_the_others() -> None:
    weight = torch.tensor([0.0, 1.0, 3.0, 0.0]).double()
    found = random_streams.drawn(weight, torch.linspace(0, 1, 4001))
    counts = torch.bincount(found, minlength=4).tolist()
    assert (counts[0], counts[3]) == (0, 0)
    assert abs(counts[1] - 1000) <= 1
