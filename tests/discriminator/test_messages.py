"""Rollouts and states as messages, and what no message may be."""

from discriminator.messages import state_chunks, state_of
from tests.support.style_cases import assert_equal_states, local, rollout


def test_states_cross_the_wire_bit_for_bit() -> None:
    style = local()
    style.score(0, **rollout(0))
    style.train(0)
    assert_equal_states(state_of(state_chunks(style.state_dict())), style.state_dict())
