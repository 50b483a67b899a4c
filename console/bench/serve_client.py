"""The client process of `inhabit bench serve`: latencies and rates as JSON.

`python -m console.bench.serve_client ADDRESS SECONDS [unary]` prints one JSON object per
measurement and waits for a line after each; `unary` leaves the streams out.
"""

import asyncio
import json
import os
import sys
import time
from typing import Any

import grpc
import numpy as np

from rpc.v1 import policy_pb2 as pb
from rpc.v1 import policy_pb2_grpc

CLIENT_CORE = 1
HZ = 30.0
STREAMS = (64, 256, 1024)
CALLERS = 64
_METADATA = (("application", "sit"),)  # names the deployment of Ray Serve


class Client:
    """Measurements on one connection."""

    def __init__(self, stub: Any, seconds: float) -> None:
        self._stub, self._seconds = stub, seconds
        draw = np.random.default_rng(0)
        self._state = draw.standard_normal(114).astype("<f4").tobytes()
        self._goal = draw.standard_normal(29).astype("<f4").tobytes()

    async def act(self, callers: int) -> dict[str, float]:
        """Measure Act with one row, by concurrent callers that each wait for the reply."""
        spent: list[float] = []
        began = time.perf_counter()

        async def caller() -> None:
            while (before := time.perf_counter()) - began < self._seconds:
                await self._stub.Act(
                    pb.ActRequest(task="sit", state=self._state, goal=self._goal),
                    metadata=_METADATA,
                )
                spent.append(time.perf_counter() - before)

        await asyncio.gather(*(caller() for _ in range(callers)))
        return _figures(spent, time.perf_counter() - began)

    async def control(self, streams: int, paced: bool) -> dict[str, float]:
        """Measure Control with a number of streams, at 30 Hz each or as fast as possible."""
        spent: list[float] = []
        calls = [self._stub.Control() for _ in range(streams)]
        for call in calls:
            await call.wait_for_connection()
        began = time.perf_counter()
        loop = asyncio.get_running_loop()

        async def character(number: int, call: Any) -> None:
            due = loop.time() + (number / streams) / HZ
            sequence = 0
            while time.perf_counter() - began < self._seconds:
                if paced:
                    await asyncio.sleep(due - loop.time())
                    due = max(due + 1.0 / HZ, loop.time())
                before = time.perf_counter()
                await call.write(
                    pb.ControlRequest(
                        task="sit",
                        sequence=sequence,
                        observation=pb.Observation(state=self._state, goal=self._goal),
                    )
                )
                reply = await call.read()
                assert reply.sequence == sequence
                spent.append(time.perf_counter() - before)
                sequence += 1
            await call.done_writing()

        await asyncio.gather(*(character(i, call) for i, call in enumerate(calls)))
        return _figures(spent, time.perf_counter() - began)


def _figures(spent: list[float], wall: float) -> dict[str, float]:
    half, most = np.percentile(np.array(spent[len(spent) // 10 :]), (50, 99))
    return {"p50_ms": 1e3 * half, "p99_ms": 1e3 * most, "per_s": len(spent) / wall}


async def measure(address: str, seconds: float, streaming: bool) -> None:
    """Run all measurements in turn and print a line of JSON after each."""
    async with grpc.aio.insecure_channel(address) as channel:
        client = Client(policy_pb2_grpc.PolicyStub(channel), seconds)

        async def report(name: str, measuring: Any) -> None:
            print(json.dumps({"name": name, **await measuring}), flush=True)
            sys.stdin.readline()  # the parent reads the server's processor time meanwhile

        await client.act(1)  # connects and warms up
        await report("act", client.act(1))
        await report(f"act_{CALLERS}", client.act(CALLERS))
        if streaming:
            await report("control", client.control(1, paced=False))
            await report(f"control_{CALLERS}", client.control(CALLERS, paced=False))
            for streams in STREAMS:
                await report(f"streams_{streams}", client.control(streams, paced=True))


if __name__ == "__main__":
    from rpc.aio_server import run

    os.sched_setaffinity(0, {CLIENT_CORE})
    run(measure(sys.argv[1], float(sys.argv[2]), "unary" not in sys.argv))
