"""The replay memory: what it keeps, and that a batch sent again changes nothing."""

import numpy as np
import torch

from discriminator.replay import Replay


def test_replay_keeps_all_until_full_then_a_share() -> None:
    memory = Replay(1000, 1, seed=0)
    rows = torch.arange(900.0).unsqueeze(1)
    assert memory.insert(rows, 0, 0.01) == 900
    assert memory.insert(rows[:200], 1, 0.0) == 100  # exactly what fits
    assert torch.equal(memory.rows[:, 0], torch.cat([torch.arange(900.0), torch.arange(100.0)]))
    new = torch.full((100_000, 1), -1.0)
    kept = memory.insert(new, 2, 0.002)
    assert 150 < kept < 250  # binomial: mean 200, deviation 14
    assert int((memory.rows == -1).sum()) == kept  # distinct slots


def test_inserting_a_batch_again_from_the_same_state_changes_nothing() -> None:
    memory = Replay(100, 1, seed=5)
    memory.insert(torch.zeros(100, 1), 0, 1.0)
    memory.insert(torch.arange(1.0, 1001.0).unsqueeze(1), 1, 0.05)
    once = memory.rows.clone()
    memory.insert(torch.arange(1.0, 1001.0).unsqueeze(1), 1, 0.05)
    assert torch.equal(memory.rows, once)
    assert memory.sample(7, np.random.default_rng(0)).shape == (7, 1)
