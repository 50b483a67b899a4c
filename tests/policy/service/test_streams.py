"""Open streams: how many there may be, and the end of those that stand still."""

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Iterator
from typing import Any

import grpc

from policy.config import BatchConfig, PolicyServiceConfig
from rpc.server import ServerConfig
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import (
    act,
    chair,
    fixed,
    make,
    observation,
    refusal,
    running,
    stub,
)

StatusCode = grpc.StatusCode


def test_limits_are_kept_and_named() -> None:
    config = PolicyServiceConfig(
        batch=BatchConfig(max_queued_rows=8, max_wait_s=0.3),
        max_streams=2,
        idle_s=1.0,
        stalled_s=1.0,
        poll_s=0.5,
    )
    with running([fixed(make())], config) as found, stub(found) as client:
        code, said = refusal(act(client, state=bytes(456 * 9), goal=bytes(116 * 9)))
        assert code is StatusCode.RESOURCE_EXHAUSTED and "at most 8 may" in said
        hold = threading.Event()

        def slowly() -> Iterator[pb.ControlRequest]:
            state, goal = observation(0)
            yield pb.ControlRequest(observation=pb.Observation(state=state, goal=goal))
            hold.wait(20)

        open_ones = [client.Control(slowly()) for _ in range(2)]
        for one in open_ones:
            next(one)
        code, said = refusal(client.Control(slowly()))
        assert code is StatusCode.RESOURCE_EXHAUSTED and "at most 2 may be" in said
        # and those that say nothing more are closed
        code, said = refusal(open_ones[0])
        assert code is StatusCode.DEADLINE_EXCEEDED and "sent nothing for 1 s" in said
        hold.set()


def test_a_client_that_never_reads_is_let_go() -> None:
    config = PolicyServiceConfig(stalled_s=1.0, poll_s=0.5)
    narrow = [("grpc.http2.bdp_probe", 0), ("grpc.http2.lookahead_bytes", 4096)]
    with running([fixed(make())], config) as found, stub(found, narrow) as client:
        # a synthesis has more to say than a client takes without reading
        request = pb.SynthesizeRequest(
            furniture=chair(), seconds=60.0, to_the_end=True, bodies=True
        )
        call = client.Synthesize(request)
        deadline = time.monotonic() + 30
        while not found.now(lambda: len(found.service.syntheses)):
            assert time.monotonic() < deadline
            time.sleep(0.05)
        while found.now(lambda: len(found.service.syntheses)):
            assert time.monotonic() < deadline, "it still waits for a client that never reads"
            time.sleep(0.1)
        assert client.Describe(pb.DescribeRequest()).policies
        code, said = refusal(call)
        assert code is StatusCode.DEADLINE_EXCEEDED and "took no reply for 1 s" in said


def test_a_client_is_not_blamed_for_the_time_that_the_service_takes() -> None:
    """Decomposing a mesh takes minutes: the stream was closed, as its client "sent nothing"."""
    config = PolicyServiceConfig(idle_s=0.3, stalled_s=30.0, poll_s=0.1)
    with running([fixed(make())], config) as found, stub(found) as client:
        simulate = found.service._synthesis.run  # pyright: ignore[reportPrivateUsage]

        async def slowly(*given: Any) -> AsyncIterator[pb.SynthesizeReply]:
            await asyncio.sleep(2.5)
            async for part in simulate(*given):
                yield part

        found.service._synthesis.run = slowly  # pyright: ignore
        parts = list(client.Synthesize(pb.SynthesizeRequest(furniture=chair(), seconds=0.2)))
        assert parts[-1].HasField("summary")


def test_draining_lets_streams_go_on_for_a_while() -> None:
    with running([fixed(make())], None, ServerConfig(drain_s=2.0)) as found, stub(found) as client:
        state, goal = observation(0)
        turns = threading.Semaphore(1)

        def sent() -> Iterator[pb.ControlRequest]:
            for sequence in range(1000):
                turns.acquire(timeout=20)
                seen = pb.Observation(state=state, goal=goal)
                yield pb.ControlRequest(sequence=sequence, observation=seen)

        replies = client.Control(sent())
        next(replies)
        found.stop()
        time.sleep(0.3)
        turns.release()
        assert next(replies).sequence == 1, "a stream goes on while the server drains"
        code, said = refusal(lambda: act(client)())  # pyright: ignore
        assert code is StatusCode.UNAVAILABLE
        code, said = refusal(replies)
        assert code is StatusCode.UNAVAILABLE and "shutting down" in said
        turns.release()
