"""The policy service as it lives: limits, deadlines, better and worse checkpoints, its end."""

import time

import grpc

from policy.config import BatchConfig, PolicyServiceConfig
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import (
    act,
    fixed,
    make,
    observation,
    refusal,
    running,
    stub,
)

StatusCode = grpc.StatusCode


def test_deadlines_are_kept() -> None:
    config = PolicyServiceConfig(batch=BatchConfig(max_wait_s=2.0))
    with running([fixed(make())], config) as found, stub(found) as client:
        found.now(lambda: setattr(found.service.batchers["sit"], "streams", 5))
        state, goal = observation(0)
        began = time.monotonic()
        code, _ = refusal(lambda: client.Act(pb.ActRequest(state=state, goal=goal), timeout=0.3))
        assert code is StatusCode.DEADLINE_EXCEEDED and time.monotonic() - began < 1.5
        while found.now(lambda: found.service.batchers["sit"].calls):
            time.sleep(0.02)  # the handler itself was ended, too
        assert found.now(lambda: found.service.batchers["sit"].queued_rows) <= 1


def test_nothing_waits_where_everyone_has_asked() -> None:
    """With one caller, an answer does not wait for the others that cannot come."""
    config = PolicyServiceConfig(batch=BatchConfig(max_wait_s=5.0))
    with running([fixed(make())], config) as found, stub(found) as client:
        began = time.monotonic()
        act(client)()  # pyright: ignore
        assert time.monotonic() - began < 2.0
