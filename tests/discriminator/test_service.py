"""The discriminator service over loopback: the same numbers, refusals, retries, killed and back."""

import os
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import grpc
import pytest
import torch

from discriminator.client import StyleClient
from discriminator.errors import StyleError, TurnError
from discriminator.journal import Journal
from discriminator.messages import rollout_chunks, state_chunks, state_of
from discriminator.process import ServiceSpec, start_process
from discriminator.service import ServiceConfig, start
from discriminator.trainer import Discriminator
from rpc.channel import ChannelConfig
from rpc.chunks import CHUNK
from rpc.errors import UnreachableError
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc
from tests.support.style_cases import SMALL, WIDTH, Mocap, assert_equal_states, rollout

SPEC = ServiceSpec(mocap="tests.support.style_cases:make_mocap", style=SMALL)


@pytest.fixture
def server() -> Iterator[Server]:
    server = start(Discriminator(SMALL, Mocap(), 0), ServerConfig())
    yield server
    server.drain()


@pytest.fixture
def client(server: Server) -> Iterator[StyleClient]:
    client = StyleClient(ChannelConfig(server.address, patience_s=20))
    yield client
    client.close()


def local() -> Discriminator:
    return Discriminator(SMALL, Mocap(), 0)


def refusal(server: Server, chunks: list[pb.ScoreChunk]) -> tuple[grpc.StatusCode, str]:
    """Status and message of a Score call that must be refused."""
    with grpc.insecure_channel(server.address) as channel:
        with pytest.raises(grpc.RpcError) as caught:
            style_pb2_grpc.StyleStub(channel).Score(iter(chunks), timeout=10)
        error = caught.value
        assert isinstance(error, grpc.Call)
        return error.code(), error.details() or ""


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


def test_restored_elsewhere_it_goes_on_exactly(client: StyleClient) -> None:
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


def test_a_truncated_or_foreign_state_changes_nothing(server: Server, client: StyleClient) -> None:
    before = client.state_dict()
    chunks = list(state_chunks(before))
    with grpc.insecure_channel(server.address) as channel:
        stub = style_pb2_grpc.StyleStub(channel)
        for wrong in (chunks[:-1], chunks[:-2], chunks[1:], [], chunks + chunks[1:]):
            with pytest.raises(grpc.RpcError, match=r"INVALID_ARGUMENT"):
                stub.Restore(iter(wrong), timeout=10)
    other = Discriminator(replace(SMALL, hidden=(16,)), Mocap(), 0)
    with pytest.raises(StyleError, match=r"network/layers\.0\.weight is \[16, 14\]"):
        client.load_state_dict(other.state_dict())
    assert_equal_states(before, client.state_dict())


def test_bad_rollouts_are_refused_by_field(server: Server, client: StyleClient) -> None:
    def chunks(**changes: object) -> list[pb.ScoreChunk]:
        good = rollout(0)
        return rollout_chunks(
            0, None, good["rollout_states"], good["end_index"], good["end_states"], good["valid"]
        )

    def with_header(**changes: int) -> list[pb.ScoreChunk]:
        made = chunks()
        for name, value in changes.items():
            setattr(made[0].header, name, value)
        return made

    for made, message in [
        (with_header(width=6), "header.width: 6, must be 7 (numbers a state)"),
        (with_header(steps=0), "must be 1 or more"),
        (with_header(batch=-1), "header.batch: -1, must be 0 or more"),
        (with_header(format=9), "must be 1 (float32) or 2 (float16)"),
        (with_header(ends=999), "header.ends: 999, must be 0..64"),
        (with_header(steps=5), "states: 2240 bytes, must be 2688 (<f4 [6, 16, 7])"),
        (with_header(steps=1 << 40), "must be at most"),
        (chunks()[:-1], "valid: 0 bytes, must be 64 (|u1 [4, 16])"),
        (chunks()[1:], "header: must come first"),
        ([], "header: must come first"),
        (chunks() + chunks()[:1], "must be one of states, end_index, end_states, valid"),
        (chunks() + chunks()[-1:], "valid: more than 64 bytes"),
    ]:
        code, details = refusal(server, made)
        assert code is grpc.StatusCode.INVALID_ARGUMENT
        assert message in details
        assert "\n" not in details
    batch = rollout(0)
    batch["rollout_states"][1, 2, 3] = float("inf")
    with pytest.raises(StyleError, match="not finite"):
        client.score(0, **batch)
    batch = rollout(0)
    with pytest.raises(StyleError, match="states: shape"):
        client.score(0, **dict(batch, rollout_states=batch["rollout_states"][..., :-1]))
    assert client.status().batches == 0


def test_out_of_turn_is_said(client: StyleClient) -> None:
    with pytest.raises(TurnError, match="score a rollout first"):
        client.train(0)
    client.score(0, **rollout(0))
    with pytest.raises(TurnError, match="must be 0"):
        client.train(4)
    client.version = 3
    with pytest.raises(TurnError, match="restore the service from the run's checkpoint"):
        client.score(1, **rollout(1))


def test_large_rollouts_go_in_small_messages_and_halves_nearly_agree() -> None:
    server = start(Discriminator(SMALL, Mocap(), 0), ServerConfig(max_message_bytes=1_000_000))
    whole = StyleClient(ChannelConfig(server.address, patience_s=20))
    half = StyleClient(ChannelConfig(server.address, patience_s=20), half=True)
    try:
        large = rollout(1, steps=16, scenes=4096)
        chunks = rollout_chunks(0, 0, large["rollout_states"], *list(large.values())[1:])
        assert len(chunks) > 5
        assert max(chunk.ByteSize() for chunk in chunks) < 1_000_000
        assert CHUNK < 1_000_000
        exact = whole.score(0, **large).reward
        assert exact.shape == (16, 4096)
        torch.testing.assert_close(half.score(1, **large).reward, exact, atol=2e-3, rtol=2e-3)
    finally:
        whole.close()
        half.close()
        server.drain()


def test_a_service_may_train_by_itself() -> None:
    style = local()
    server = start(style, ServerConfig(), ServiceConfig(train_every=2))
    client = StyleClient(ChannelConfig(server.address, patience_s=20))
    try:
        for k in range(5):
            client.score(k, **rollout(k))
            assert client.train(k) == {}
        deadline = time.monotonic() + 20
        while client.status().version < 2 and time.monotonic() < deadline:
            time.sleep(0.02)
        time.sleep(0.1)
        assert client.status().version == 2  # five rollouts, one training for every two
    finally:
        client.close()
        server.drain()


def test_states_cross_the_wire_bit_for_bit() -> None:
    style = local()
    style.score(0, **rollout(0))
    style.train(0)
    assert_equal_states(state_of(state_chunks(style.state_dict())), style.state_dict())


def test_killed_and_back_it_goes_on_exactly(tmp_path: Path) -> None:
    style, said = local(), []
    service = ServiceConfig(state=str(tmp_path / "style"))
    process = start_process(replace(SPEC, service=service), said.append)
    waiting: list[str] = []
    config = ChannelConfig(process.address, deadline_s=20, patience_s=60)
    client = StyleClient(config, waiting.append)
    try:
        for k in range(8):
            here = style.score(k, **rollout(k))
            if k == 2:  # before a rollout is scored: the client waits, then scores
                os.kill(process.pid, signal.SIGKILL)
            there = client.score(k, **rollout(k))
            assert torch.equal(there.reward, here.reward)
            assert there.version == k
            if k == 5:  # scored and not yet trained: the client sends the rollout again
                os.kill(process.pid, signal.SIGKILL)
            assert client.train(k) == style.train(k)
        assert_equal_states(client.state_dict(), style.state_dict())
        assert len(said) == 2
        assert sum("is away" in line for line in waiting) == 2
    finally:
        client.close()
        process.stop()


def test_a_service_that_lost_its_state_never_scores_as_if_nothing_had_been() -> None:
    process = start_process(SPEC)
    client = StyleClient(ChannelConfig(process.address, patience_s=60))
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
        StyleClient(ChannelConfig(process.address, patience_s=0.3))


def test_a_crash_loop_ends_the_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("discriminator.process.LIVES", 1)
    process = start_process(SPEC)
    client = StyleClient(ChannelConfig(process.address), lost=lambda: process.lost)
    try:
        os.kill(process.pid, signal.SIGKILL)
        began = time.monotonic()
        with pytest.raises(UnreachableError, match=r"ended 1 times in a minute \(status -9\)"):
            client.score(0, **rollout(0))
        assert time.monotonic() - began < 60  # of 900 s of patience
    finally:
        client.close()
        process.stop()


def test_a_service_that_cannot_start_says_why_in_one_line(server: Server, tmp_path: Path) -> None:
    for spec, message in [
        (replace(SPEC, mocap="tests.support.style_cases:make_nothing"), "no clips in nowhere"),
        (replace(SPEC, mocap="tests.support.style_cases:none"), "has no attribute 'none'"),
        (replace(SPEC, server=ServerConfig(listen=server.address)), "Address already in use"),
    ]:
        with pytest.raises(StyleError, match=f"^style service: .*{message}"):
            start_process(spec)
    (tmp_path / "state.safetensors").write_bytes(b"torn")
    with pytest.raises(StyleError, match="remove it to start anew"):
        start(local(), ServerConfig(), journal=Journal(tmp_path))


def test_specs_survive_json() -> None:
    spec = replace(SPEC, object_mask=[False] * WIDTH, arguments={"clips": ["a"], "mirror": True})
    assert ServiceSpec.from_json(spec.to_json()) == spec
