"""The discriminator service over loopback: the same numbers, refusals, retries, killed and back."""

from dataclasses import replace

import grpc
import pytest
import torch

from discriminator.client import StyleClient
from discriminator.errors import StyleError, TurnError
from discriminator.messages import rollout_chunks, state_chunks
from discriminator.service import start
from discriminator.trainer import Discriminator
from rpc.channel import ChannelConfig
from rpc.chunks import CHUNK
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc
from tests.support.style_cases import SMALL, Mocap, assert_equal_states, rollout


def refusal(server: Server, chunks: list[pb.ScoreChunk]) -> tuple[grpc.StatusCode, str]:
    """Status and message of a Score call that must be refused."""
    with grpc.insecure_channel(server.address) as channel:
        with pytest.raises(grpc.RpcError) as caught:
            style_pb2_grpc.StyleStub(channel).Score(iter(chunks), timeout=10)
        error = caught.value
        assert isinstance(error, grpc.Call)
        return error.code(), error.details() or ""


def test_a_truncated_or_foreign_state_changes_nothing(server: Server, client: StyleClient) -> None:
    before = client.state_dict()
    chunks = list(state_chunks(before))
    with grpc.insecure_channel(server.address) as channel:
        stub = style_pb2_grpc.StyleStub(channel)
        for wrong in (chunks[:-1], chunks[:-2], chunks[1:], [], chunks + chunks[1:]):
            with pytest.raises(grpc.RpcError, match=r"INVALID_ARGUMENT"):
                stub.Restore(iter(wrong), timeout=10)
    # without its replay it would train on what is in the rows by chance
    without = {name: tensor for name, tensor in before.items() if name != "replay"}
    with pytest.raises(StyleError, match="discriminator state: replay is missing"):
        client.load_state_dict(without)
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


def test_calls_out_of_order_are_refused(client: StyleClient) -> None:
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
    whole = StyleClient(ChannelConfig(server.address, retry_s=20))
    half = StyleClient(ChannelConfig(server.address, retry_s=20), half=True)
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
