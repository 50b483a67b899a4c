"""The policy service as it lives: limits, deadlines, better and worse checkpoints, its end."""

import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import grpc
import numpy as np
import pytest

from policy.checkpoints.reload import Source
from policy.config import BatchConfig, PolicyServiceConfig
from policy.errors import CheckpointError, LayoutError
from rpc.errors import RpcError
from rpc.server import ServerConfig
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import (
    act,
    chair,
    expected,
    fixed,
    load,
    make,
    numbers,
    observation,
    refusal,
    running,
    save,
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


def test_a_better_checkpoint_replaces_the_old_in_an_open_stream(tmp_path: Path) -> None:
    save(tmp_path / "000001", 1)
    best = tmp_path / "best"
    best.symlink_to("000001")

    def find_best() -> Path:
        if not best.exists():
            raise CheckpointError(f"{best} does not exist")
        return best.resolve()

    source = Source("sit", find_best, load)
    config = PolicyServiceConfig(poll_s=0.1)
    state, goal = observation(0)
    frames: list[int] = []
    more = threading.Semaphore(0)

    def sent() -> Iterator[pb.ControlRequest]:
        while more.acquire(timeout=60) and frames[-1] >= 0:
            seen = pb.Observation(state=state, goal=goal)
            yield pb.ControlRequest(sequence=frames[-1], observation=seen)

    def point_at(name: str) -> None:
        (tmp_path / "new").symlink_to(name)
        (tmp_path / "new").replace(best)

    def until(happened: object) -> None:
        deadline = time.monotonic() + 30
        while not happened():  # pyright: ignore
            assert time.monotonic() < deadline
            time.sleep(0.05)

    with running([source], config) as found, stub(found) as client:
        replies = client.Control(sent())

        def ask() -> pb.ControlReply:
            frames.append(len(frames))
            more.release()
            return next(replies)

        def description() -> pb.PolicyDescription:
            return client.Describe(pb.DescribeRequest()).policies[0]

        first = ask()
        assert first.version == description().version and first.version.startswith("1-")
        save(tmp_path / "000002", 2)
        point_at("000002")
        until(lambda: description().reloads == 1)
        second = ask()
        assert second.version == description().version and second.version.startswith("2-")
        np.testing.assert_allclose(
            numbers(second.action), expected(2, state, goal), rtol=2e-5, atol=2e-6
        )
        # corrupt, foreign, truncated, gone: the old one stays, and Describe says why
        save(tmp_path / "000003", 3)
        (tmp_path / "000003" / "policy.safetensors").write_bytes(b"garbage")
        point_at("000003")
        until(lambda: "damaged" in description().last_refusal)
        foreign = tmp_path / "000004"
        foreign.mkdir()
        (foreign / "manifest.json").write_text('{"format": 99}')
        point_at("000004")
        until(lambda: "format 99" in description().last_refusal)
        point_at("000009")
        until(lambda: "does not exist" in description().last_refusal)
        third = ask()
        assert third.version == second.version and third.action == second.action
        assert any("still serving 2-" in line for line in found.said)
        save(tmp_path / "000005", 5)
        point_at("000005")
        until(lambda: description().version.startswith("5-"))
        assert ask().version.startswith("5-") and description().last_refusal == ""
        frames.append(-1)
        more.release()


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


def test_a_policy_that_cannot_be_served_is_refused_at_the_start(tmp_path: Path) -> None:
    served = make()
    broken = {
        k: v * float("nan") if k.endswith("0.weight") else v for k, v in served.weights.items()
    }
    with pytest.raises(LayoutError, match="not finite"):
        replace(served, weights=broken).check()
    sources = [fixed(served), fixed(served)]
    with pytest.raises(Exception, match="each needs a name of its own"), running(sources):
        pass
    remote = ServerConfig(listen="0.0.0.0:0")
    with pytest.raises(RpcError, match="open to other"), running([fixed(served)], None, remote):
        pass


def test_nothing_waits_where_everyone_has_asked() -> None:
    """With one caller, an answer does not wait for the others that cannot come."""
    config = PolicyServiceConfig(batch=BatchConfig(max_wait_s=5.0))
    with running([fixed(make())], config) as found, stub(found) as client:
        began = time.monotonic()
        act(client)()  # pyright: ignore
        assert time.monotonic() - began < 2.0
