"""The discriminator over a wire: the same numbers, retries, and a service that lost its state."""

import os
import signal

import pytest
import torch

from discriminator.client import StyleClient
from discriminator.errors import TurnError
from discriminator.process import start_process
from rpc.channel import ChannelConfig
from rpc.errors import UnreachableError
from tests.support.style_cases import SPEC, assert_equal_states, local, rollout


def test_the_wire_changes_no_bit(client: StyleClient) -> None:
    style = local()
    for k in range(3):
        there, here = client.score(k, **rollout(k)), style.score(k, **rollout(k))
        assert torch.equal(there.reward, here.reward)
        assert (there.version, there.metrics) == (here.version, here.metrics) == (k, here.metrics)
        assert client.train(k) == style.train(k)
    assert_equal_states(client.state_dict(), style.state_dict())


def test_a_batch_sent_again_is_counted_once(client: StyleClient) -> None:
    first = client.score(3, **rollout(3))
    before = client.state_dict()
    again = client.score(3, **rollout(3))
    assert torch.equal(first.reward, again.reward)
    assert_equal_states(before, client.state_dict())
    status = client.status()
    assert (status.batches, status.transitions, status.replay_size) == (1, 63, 63)
    metrics = client.train(0)
    assert client.train(0) == metrics
    assert client.status().version == 1


def test_restored_in_another_process_it_continues_exactly(client: StyleClient) -> None:
    style = local()
    for k in range(6):
        style.score(k, **rollout(k))
        style.train(k)
    client.load_state_dict(style.state_dict())
    assert client.version == 6
    assert_equal_states(client.state_dict(), style.state_dict())
    assert torch.equal(client.score(6, **rollout(6)).reward, style.score(6, **rollout(6)).reward)
    assert client.train(6) == style.train(6)
    assert_equal_states(client.state_dict(), style.state_dict())


def test_a_service_that_lost_its_state_never_scores_as_if_nothing_had_been() -> None:
    process = start_process(SPEC)
    client = StyleClient(ChannelConfig(process.address, retry_s=60))
    try:
        client.score(0, **rollout(0))
        client.train(0)
        kept = client.state_dict()
        os.kill(process.pid, signal.SIGKILL)
        with pytest.raises(TurnError, match=r"header\.version: 1, must be 0"):
            client.score(1, **rollout(1))
        client.load_state_dict(kept)
        assert client.score(1, **rollout(1)).version == 1
    finally:
        client.close()
        process.stop()
    with pytest.raises(UnreachableError):
        StyleClient(ChannelConfig(process.address, retry_s=0.3))
