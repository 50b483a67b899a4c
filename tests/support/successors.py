"""True successors of a rollout's states."""

from torch import Tensor

from policy.rollout import Rollout, successors


def next_states(rollout: Rollout) -> Tensor:
    """[T, N, 114]: at the end of an episode its last state, not the next one's first."""
    return successors(rollout.states, rollout.end_index, rollout.end_states)
