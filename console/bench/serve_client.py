"""The client process of `inhabit bench serve`: latencies and rates as JSON.

`python -m console.bench.serve_client ADDRESS SECONDS [unary]` prints one JSON object per
measurement and waits for a line after each; `unary` leaves the streams out. With `paced` it
measures a few characters alone, once; with `flood-rows` or `flood-poses` it measures nothing, says
that it runs, and asks for as much as it may until its standard input ends.
"""

import asyncio
import json
import os
import sys
import time
from typing import Any

import grpc
import numpy as np

from policy.config import PolicyServiceConfig
from rpc.v1 import policy_pb2 as pb
from rpc.v1 import policy_pb2_grpc
from world.character.model import standing_qpos

CLIENT_CORE = 1
HZ = 30.0
STREAMS = (64, 256, 1024)
CALLERS = 64
#: Characters that are watched while another client floods, and the flood's calls at a time.
CHARACTERS, FLOOD = 16, 8
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


def flood_of(kind: str) -> tuple[str, bytes]:
    """The largest call that the service takes by default: its method, and its bytes."""
    limits = PolicyServiceConfig()
    if kind == "flood-rows":
        n, draw = limits.max_rows, np.random.default_rng(0)
        state, goal = (draw.standard_normal((n, w)).astype("<f4").tobytes() for w in (114, 29))
        return "Act", pb.ActRequest(task="sit", state=state, goal=goal).SerializeToString()
    standing = standing_qpos().tolist()
    pose = pb.Pose(
        root_position=standing[:3],
        root_rotation=standing[3:7],
        root_velocity=[0.0] * 3,
        root_angular_velocity=[0.0] * 3,
        joint_position=standing[7:],
        joint_velocity=[0.0] * 28,
    )
    chair = pb.Furniture(
        position=[1.0, 0.0, 0.0],
        rotation=[1.0, 0.0, 0.0, 0.0],
        piece="chair-test-000",
    )
    one = pb.Situation(pose=pose, furniture=chair)
    request = pb.ActFromPoseRequest(task="sit", situations=[one] * limits.max_poses)
    return "ActFromPose", request.SerializeToString()


async def flood(address: str, kind: str) -> None:
    """Ask for as much as the service takes, FLOOD calls at a time, until standard input ends; the
    calls are made ready before, so that they cost the server and not this process."""
    method, request = flood_of(kind)
    ended = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    async with grpc.aio.insecure_channel(address) as channel:
        # bytes as they are, in both directions
        call = channel.unary_unary(f"/rpc.v1.Policy/{method}")

        async def caller() -> None:
            while not ended.done():
                try:
                    await call(request)
                except grpc.aio.AioRpcError as error:
                    if error.code() is not grpc.StatusCode.RESOURCE_EXHAUSTED:
                        raise
                    await asyncio.sleep(0.01)

        await call(request)
        print(json.dumps({"name": kind}), flush=True)
        await asyncio.gather(*(caller() for _ in range(FLOOD)))


async def watched(address: str, seconds: float) -> None:
    """Print the latencies of a few characters at 30 Hz."""
    async with grpc.aio.insecure_channel(address) as channel:
        client = Client(policy_pb2_grpc.PolicyStub(channel), seconds)
        await client.act(1)
        print(json.dumps(await client.control(CHARACTERS, paced=True)), flush=True)
        sys.stdin.readline()


if __name__ == "__main__":
    from rpc.aio_server import run

    os.sched_setaffinity(0, {CLIENT_CORE})
    where, duration, how = sys.argv[1], float(sys.argv[2]), sys.argv[3:]
    if how and how[0].startswith("flood"):
        os.nice(10)  # the characters' client shares this core
        run(flood(where, how[0]))
    elif how == ["paced"]:
        run(watched(where, duration))
    else:
        run(measure(where, duration, "unary" not in how))
