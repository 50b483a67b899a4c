"""Pairs of states and their true successors, and what cannot be paired."""

import pytest
import torch

from discriminator.errors import StyleError
from discriminator.pairing import check_rollout, next_states


def test_successors_of_ended_episodes_are_their_last_states() -> None:
    states = torch.arange(3 * 2, dtype=torch.float32).reshape(3, 2, 1)
    after = next_states(states, torch.tensor([[0, 1], [1, 0]]), torch.tensor([[-1.0], [-2.0]]))
    assert after.squeeze(-1).tolist() == [[2.0, -1.0], [-2.0, 5.0]]
    assert states[1, 1, 0] == 3.0  # the rollout itself is left alone


def test_a_rollout_of_another_shape_is_refused_by_field() -> None:
    states, ends = torch.zeros(3, 2, 4), torch.zeros(0, 2, dtype=torch.int64)
    valid = torch.ones(2, 2, dtype=torch.bool)
    check_rollout(states, ends, torch.zeros(0, 4), valid, 4)
    wrong = [
        (states, ends, torch.zeros(0, 4), valid, 5, "states"),
        (states, ends.int(), torch.zeros(0, 4), valid, 4, "end_index"),
        (states, torch.tensor([[2, 0]]), torch.zeros(1, 4), valid, 4, "end_index"),
        (states, torch.tensor([[0, -1]]), torch.zeros(1, 4), valid, 4, "end_index"),
        (states, ends, torch.zeros(1, 4), valid, 4, "end_states"),
        (states, ends, torch.zeros(0, 4), valid[:1], 4, "valid"),
    ]
    for a, b, c, d, width, field in wrong:
        with pytest.raises(StyleError, match=f"^{field}: "):
            check_rollout(a, b, c, d, width)
