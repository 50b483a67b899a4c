"""Windows of states against what can be read off small rollouts by hand."""

import pytest
import torch
from torch import Tensor

from discriminator.errors import StyleError
from discriminator.windows import Windows


def rollout(first: int, steps: int = 3, scenes: int = 2) -> Tensor:
    """States [steps + 1, scenes, 1]: the number of the control step, plus 100 in scene 1."""
    time = torch.arange(first, first + steps + 1).float()
    return (time[:, None] + 100.0 * torch.arange(scenes))[..., None]


NONE = torch.empty(0, 2, dtype=torch.int64), torch.empty(0, 1)
VALID = torch.ones(3, 2, dtype=torch.bool)


def test_transitions_are_the_papers() -> None:
    ends = torch.tensor([[1, 0]]), torch.tensor([[7.0]])
    rows, whole = Windows(2, 1).rows(rollout(0), *ends, VALID)
    assert rows.tolist() == [[0, 1], [100, 101], [1, 7], [101, 102], [2, 3], [102, 103]]
    assert bool(whole.all())
    assert Windows(2, 1).state_dict() == {}


def test_a_window_goes_back_into_the_rollout_before_but_not_before_its_episode() -> None:
    windows = Windows(4, 1)
    rows, whole = windows.rows(rollout(0), *NONE, VALID)
    # scene 0: copies of the first state until there are three states before the successor
    assert rows[::2].tolist() == [[0, 0, 0, 1], [0, 0, 1, 2], [0, 1, 2, 3]]
    assert whole[::2].tolist() == [False, False, True]
    # scene 0 goes on; an episode ends in scene 1 at the first step, in state 55
    states = rollout(3)
    states[1:, 1] = torch.tensor([[900.0], [901.0], [902.0]])
    rows, whole = windows.rows(states, torch.tensor([[0, 1]]), torch.tensor([[55.0]]), VALID)
    assert rows[::2].tolist() == [[1, 2, 3, 4], [2, 3, 4, 5], [3, 4, 5, 6]]
    assert rows[1::2].tolist() == [
        [101, 102, 103, 55],
        [900, 900, 900, 901],
        [900, 900, 901, 902],
    ]
    assert whole.tolist() == [True, True, True, False, True, False]


def test_a_scene_that_became_invalid_begins_anew() -> None:
    windows = Windows(3, 1)
    windows.rows(rollout(0), *NONE, VALID)
    states, valid = rollout(3), VALID.clone()
    states[0, 1], valid[0, 1] = float("nan"), False
    rows, whole = windows.rows(states, *NONE, valid)
    assert rows[3].tolist() == [104, 104, 105]
    assert whole[1::2].tolist() == [True, False, True]
    assert bool(windows.state_dict()["past"].isfinite().all())


def test_a_restart_changes_nothing() -> None:
    one, other = Windows(5, 1), Windows(5, 1)
    one.rows(rollout(0), *NONE, VALID)
    other.load_state_dict(one.state_dict())
    for found, wanted in zip(
        one.rows(rollout(3), *NONE, VALID), other.rows(rollout(3), *NONE, VALID), strict=True
    ):
        assert torch.equal(found, wanted)


def test_fewer_than_two_states_are_no_window() -> None:
    with pytest.raises(StyleError, match="must be 2 states or more"):
        Windows(1, 1)
