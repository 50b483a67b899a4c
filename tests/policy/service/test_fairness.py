"""One client never keeps the others: counts come first, work goes in parts, what nobody waits for
ends, and a disk that hangs keeps nothing."""

import asyncio
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import grpc
import numpy as np
import pytest
from prometheus_client import CollectorRegistry

from policy.checkpoints.reload import Source
from policy.checkpoints.served import Served
from policy.config import BatchConfig, PolicyServiceConfig, SynthesisConfig
from policy.errors import BusyError, RequestError
from policy.objects import placement
from policy.service.batching import PART_ROWS, TURNS, Batcher, BatchMetrics
from policy.service.servicer import _PART
from rpc.v1 import policy_pb2 as pb
from tests.support.paths import ROOT
from tests.support.policy_cases import (
    SIT,
    WIDTH,
    act,
    chair,
    expected,
    fixed,
    load,
    make,
    numbers,
    observation,
    pose,
    refusal,
    renamed,
    running,
    save,
    stub,
)  # fmt: skip


def test_boxes_are_counted_before_any_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    shape = pb.Shape(hip=[0, 0, 0.4], boxes=[pb.SolidBox()] * 85_000)
    looked: list[str] = []
    monkeypatch.setattr(placement, "_box", lambda box, name: looked.append(name))
    with pytest.raises(RequestError, match=r"custom\.boxes: 85000, must be at most 64"):
        placement.custom(shape, SIT)
    assert looked == []


def test_many_situations_are_read_in_parts_and_the_same() -> None:
    """The loop has its turn after each part, and the numbers are those of one at a time."""
    with running([fixed(make())]) as found, stub(found) as client:
        one = [pb.Situation(pose=pose(x=0.01 * i), furniture=chair()) for i in range(40)]
        whole = client.ActFromPose(pb.ActFromPoseRequest(situations=one))
        alone = [client.ActFromPose(pb.ActFromPoseRequest(situations=[s])).action for s in one]
        wanted = np.concatenate([numbers(a) for a in alone])
        np.testing.assert_allclose(numbers(whole.action), wanted, atol=1e-5)
        one[33].pose.root_rotation[:] = [0.0, 0, 0, 0]
        code, said = refusal(lambda: client.ActFromPose(pb.ActFromPoseRequest(situations=one)))
        assert code is grpc.StatusCode.INVALID_ARGUMENT and "situations[33].pose" in said
        several = [pb.Situation()] * 300
        code, said = refusal(lambda: client.ActFromPose(pb.ActFromPoseRequest(situations=several)))
        assert code is grpc.StatusCode.INVALID_ARGUMENT and "300 rows, must be 1 to 256" in said


def test_large_calls_are_read_one_at_a_time() -> None:
    """However many there are, a frame of a stream waits for one part of one of them."""

    async def order() -> list[str]:
        from policy.messages import requests

        seen: list[str] = []
        real = requests.poses

        def noted(messages: object, task: object, first: int = 0) -> object:
            seen.append(f"part {first}")
            return real(messages, task, first)  # type: ignore[arg-type]

        requests.poses = noted  # type: ignore[assignment]
        try:
            with running([fixed(make())]) as found:
                large = [pb.Situation(pose=pose(), furniture=chair())] * 32
                service = found.service
                waiting = [service._poses(large, SIT) for _ in range(3)]

                async def tick() -> None:
                    for _ in range(3 * 32 // _PART * TURNS):
                        seen.append("frame")
                        await asyncio.sleep(0)

                await asyncio.gather(*waiting, tick())
        finally:
            requests.poses = real
        return seen

    seen = asyncio.run(order())
    assert sum(name.startswith("part") for name in seen) == 3 * 32 // _PART
    both = [i for i, name in enumerate(seen) if name == "frame"]
    busy = seen[both[1] : both[-1]]
    marks = "".join("f" if name == "frame" else "p" for name in busy)
    # each part is followed by its turns, in which frames are read
    assert min(len(run) for run in marks.strip("f").split("p")[1:-1]) >= TURNS - 1


def test_small_requests_overtake_large_ones() -> None:
    """8192 rows of one caller wait; a single row is in the second pass at the latest."""

    async def passes() -> tuple[int, int]:
        served = make()
        batcher = Batcher(lambda: served, BatchConfig(), BatchMetrics(CollectorRegistry()))
        rows = bytes(4 * WIDTH * 256)
        large = [batcher.submit(rows, 256, False, None) for _ in range(31)]
        small = batcher.submit(rows[: 4 * WIDTH], 1, False, None)
        await small
        done = sum(one.done() for one in large)
        await asyncio.gather(*large)
        return done, len(large)

    done, count = asyncio.run(passes())
    assert done <= 2 < count


def test_a_synthesis_that_nobody_waits_for_ends_and_is_counted_until_then(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Long in the making, as of a large mesh: its place is free when it has ended, not before."""
    from policy.synthesis import streaming

    began, ended = threading.Event(), threading.Event()
    release = threading.Event()

    class Slow:
        def __init__(self, *_: object, cancelled: object) -> None:
            began.set()
            while not cancelled():  # type: ignore[operator]
                time.sleep(0.01)
            release.wait(30)
            ended.set()
            raise RequestError("given up")

    monkeypatch.setattr(streaming, "Simulation", Slow)
    config = PolicyServiceConfig(synthesis=SynthesisConfig(max_at_a_time=1))
    with running([fixed(make())], config) as found, stub(found) as client:
        call = client.Synthesize(pb.SynthesizeRequest(furniture=chair()))
        assert began.wait(30)
        call.cancel()
        time.sleep(0.3)
        assert found.now(lambda: len(found.service.syntheses)) == 1, "it still takes a core"
        code, _ = refusal(client.Synthesize(pb.SynthesizeRequest(furniture=chair())))
        assert code is grpc.StatusCode.RESOURCE_EXHAUSTED
        release.set()
        assert ended.wait(30)
        deadline = time.monotonic() + 30
        while found.now(lambda: len(found.service.syntheses)):
            assert time.monotonic() < deadline
            time.sleep(0.02)


HANGS = """
import asyncio, sys, threading
from collections.abc import Callable
from pathlib import Path
from policy.checkpoints.reload import Source
from policy.config import PolicyServiceConfig
from policy.service.servicer import serve
from rpc.server import ServerConfig
from tests.support.policy_cases import load

first = [True]
def find():
    if not first[0]:
        print("hangs", flush=True)
        threading.Event().wait()  # a network disk that is cancelled
    first[0] = False
    return Path(sys.argv[1])

asyncio.run(serve(
    [Source("sit", find, load)], ServerConfig(drain_s=2.0), PolicyServiceConfig(poll_s=0.2),
    started=lambda server, service: print(server.address, flush=True),
))
print("ended", flush=True)
"""


def test_a_disk_that_hangs_keeps_neither_calls_nor_the_end(tmp_path: Path) -> None:
    """A real process, whose checkpoint cannot be looked at any more, and a real SIGTERM."""
    save(tmp_path / "1", 1)
    process = subprocess.Popen(
        [sys.executable, "-c", HANGS, str(tmp_path / "1")], cwd=ROOT, stdout=subprocess.PIPE,
        text=True, env=dict(os.environ, PYTHONPATH=str(ROOT)),
    )  # fmt: skip
    try:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        assert process.stdout.readline() == "hangs\n"
        from rpc.v1 import policy_pb2_grpc

        with grpc.insecure_channel(address) as channel:
            client = policy_pb2_grpc.PolicyStub(channel)
            state, goal = observation(0)
            reply = client.Act(pb.ActRequest(state=state, goal=goal), timeout=30)
            np.testing.assert_allclose(
                numbers(reply.action), expected(1, state, goal).reshape(1, -1), atol=1e-5
            )
        process.send_signal(signal.SIGTERM)
        assert process.stdout.readline() == "ended\n"
        assert process.wait(30) == 0
    finally:
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()


def test_one_hanging_policy_keeps_no_other_from_its_reload(tmp_path: Path) -> None:
    save(tmp_path / "1", 1)
    save(tmp_path / "2", 2)
    now, hang, first = [tmp_path / "1"], threading.Event(), [True]

    def stuck() -> Path:
        if not first[0]:
            hang.wait(60)
        first[0] = False
        return tmp_path / "1"

    def named(name: str) -> Callable[[Path], Served]:
        return lambda path: renamed(load(path), name)

    sources = [Source("a", stuck, named("a")), Source("b", lambda: now[0], named("b"))]
    state, goal = observation(0)
    with running(sources, PolicyServiceConfig(poll_s=0.1)) as found, stub(found) as client:
        before = act(client, task="b", state=state, goal=goal)()  # type: ignore[operator]
        now[0] = tmp_path / "2"
        deadline = time.monotonic() + 30
        while act(client, task="b", state=state, goal=goal)().version == before.version:  # type: ignore[operator]
            assert time.monotonic() < deadline
            time.sleep(0.05)
        hang.set()


class Turns:
    """A loop's turns counted, and a policy that answers at once."""

    def __init__(self) -> None:
        self.passes: list[tuple[int, int]] = []
        self.turn = 0

    async def count(self) -> None:
        while True:
            self.turn += 1
            await asyncio.sleep(0)


def counted(turns: Turns, monkeypatch: pytest.MonkeyPatch) -> Batcher:
    found = Batcher(make, BatchConfig(max_queued_rows=4096), BatchMetrics(CollectorRegistry()))
    real = found._answer

    def answer(batch: list) -> None:
        turns.passes.append((turns.turn, sum(entry.rows for entry in batch)))
        real(batch)

    monkeypatch.setattr(found, "_answer", answer)
    return found


def row(n: int) -> bytes:
    return np.zeros((n, WIDTH), "<f4").tobytes()


def test_large_requests_leave_turns_for_the_others_and_a_small_one_ends_the_pause(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In one turn of the loop gRPC hands over one message: with a pass in each they pile up."""

    async def main() -> None:
        seen = Turns()
        batcher = counted(seen, monkeypatch)
        batcher.streams = 1
        counter = asyncio.ensure_future(seen.count())
        large = [batcher.submit(row(PART_ROWS), PART_ROWS, False, None) for _ in range(6)]
        await large[2]
        assert [rows for _, rows in seen.passes] == [PART_ROWS] * 3
        apart = np.diff([turn for turn, _ in seen.passes])
        assert (apart >= TURNS).all()
        before = seen.turn
        await batcher.submit(row(1), 1, False, None)
        # alone, or together with the large one whose turn it was
        assert seen.turn - before < TURNS and seen.passes[-1][1] in (1, PART_ROWS + 1)
        await asyncio.gather(*large)
        batcher.streams, before = 0, len(seen.passes)
        await asyncio.gather(*(batcher.submit(row(32), 32, False, None) for _ in range(4)))
        alone = np.diff([turn for turn, _ in seen.passes[before:]])
        assert len(alone) == 3 and (alone < TURNS).all(), "nobody else to wait for"
        counter.cancel()

    asyncio.run(main())


def test_large_requests_never_fill_the_room_of_small_ones() -> None:
    """Two calls of another client would else have every character refused."""

    async def main() -> None:
        batcher = Batcher(make, BatchConfig(max_queued_rows=64), BatchMetrics(CollectorRegistry()))
        large = [batcher.submit(row(32), 32, False, None) for _ in range(2)]
        with pytest.raises(BusyError, match="64 rows are waiting and at most 64 may"):
            batcher.submit(row(32), 32, False, None)
        small = [batcher.submit(row(1), 1, False, None) for _ in range(64)]
        with pytest.raises(BusyError):
            batcher.submit(row(1), 1, False, None)
        assert batcher.queued_rows == 128
        await asyncio.gather(*large, *small)
        assert batcher.queued_rows == 0
        await batcher.submit(row(32), 32, False, None)

    asyncio.run(main())
