"""The policy service as it lives: limits, deadlines, better and worse checkpoints, its end."""

import time

import grpc

from policy.config import BatchConfig, PolicyServiceConfig
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import (
    fixed,
    make,
    observation,
    refusal,
    running,
    stub,
)

StatusCode = grpc.StatusCode


def test_deadlines_are_kept() -> None:
    config = PolicyServiceConfig(batch=BatchConfig(max_wait_s=600.0))
    with running([fixed(make())], config) as found, stub(found) as client:
        found.now(lambda: setattr(found.service.batchers["sit"], "streams", 5))
        state, goal = observation(0)
        code, _ = refusal(lambda: client.Act(pb.ActRequest(state=state, goal=goal), timeout=0.3))
        assert code is StatusCode.DEADLINE_EXCEEDED
        until = time.monotonic() + 60
        while found.now(lambda: found.service.batchers["sit"].calls):
            assert time.monotonic() < until, "the handler itself was ended, too"
            time.sleep(0.02)
        assert found.now(lambda: found.service.batchers["sit"].queued_rows) <= 1


def test_a_batch_does_not_wait_once_all_clients_have_sent() -> None:
    """With one caller, an answer does not wait for the others that cannot come."""
    config = PolicyServiceConfig(batch=BatchConfig(max_wait_s=600.0))
    with running([fixed(make())], config) as found, stub(found) as client:
        state, goal = observation(0)
        assert client.Act(pb.ActRequest(state=state, goal=goal), timeout=60).action
