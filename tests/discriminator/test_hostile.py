"""The style service against silent streams and clients of other trainings."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import grpc
import pytest
import torch
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2_grpc

from discriminator.client import StyleClient
from discriminator.errors import TurnError
from discriminator.process import ServiceSpec, start_process
from discriminator.service import NAME, start
from discriminator.trainer import Discriminator
from rpc.channel import ChannelConfig
from rpc.errors import RefusedError
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc
from tests.support.style_cases import SMALL, assert_equal_states, rollout, trained


@contextmanager
def served(config: ServerConfig, style: Discriminator | None = None) -> Iterator[Server]:
    server = start(style or trained(), config)
    try:
        yield server
    finally:
        server.config = replace(config, drain_s=0.0)
        server.drain()


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with served(ServerConfig()) as found:
        yield found


def silence(seconds: float) -> Iterator[pb.ScoreChunk]:
    time.sleep(seconds)
    yield from ()


def asked(address: str, service: str) -> int:
    """What health says of a service, within 5 s."""
    with grpc.insecure_channel(address) as channel:
        stub = health_pb2_grpc.HealthStub(channel)
        return stub.Check(health_pb2.HealthCheckRequest(service=service), timeout=5).status


@pytest.mark.parametrize("kind", ["score", "reflection"])
def test_silent_streams_stop_nobody(kind: str) -> None:
    """As many as there are places: health says so, short calls go on, and the places come back."""
    config = ServerConfig(streams=4, idle_s=2.0)
    with served(config) as server, grpc.insecure_channel(server.address) as channel:
        silent = []
        for _ in range(4):
            if kind == "score":
                future = style_pb2_grpc.StyleStub(channel).Score.future(silence(60))
            else:
                stub = reflection_pb2_grpc.ServerReflectionStub(channel)
                future = stub.ServerReflectionInfo(silence(60))
            silent.append(future)
        seen = until(
            lambda: asked(server.address, NAME) == health_pb2.HealthCheckResponse.NOT_SERVING
        )
        assert seen, "health tells that no stream is taken"
        assert asked(server.address, "") == health_pb2.HealthCheckResponse.SERVING
        client = StyleClient(ChannelConfig(server.address, deadline_s=30, retry_s=60))
        try:
            assert client.version == 3, "a short call is answered meanwhile"
            style = trained()
            found = client.score(3, **rollout(3))  # waits for a place
            assert torch.equal(found.reward, style.score(3, **rollout(3)).reward)
            assert client.train(3) == style.train(3)
        finally:
            client.close()
        for future in silent:
            error = future.exception(timeout=30)
            assert isinstance(error, grpc.RpcError) and error.code() is grpc.StatusCode.CANCELLED
        assert until(lambda: asked(server.address, NAME) == health_pb2.HealthCheckResponse.SERVING)


def until(true: Callable[[], bool], seconds: float = 30.0) -> bool:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if true():
            return True
        time.sleep(0.02)
    return False


def test_watchers_of_health_hold_no_worker() -> None:
    with served(ServerConfig()) as server, grpc.insecure_channel(server.address) as channel:
        stub = health_pb2_grpc.HealthStub(channel)
        watchers = [stub.Watch(health_pb2.HealthCheckRequest(service=NAME)) for _ in range(40)]
        for watcher in watchers:
            assert next(watcher).status == health_pb2.HealthCheckResponse.SERVING
        client = StyleClient(ChannelConfig(server.address, deadline_s=20, retry_s=20))
        client.score(3, **rollout(3))
        client.close()
        for watcher in watchers:
            watcher.cancel()


@pytest.mark.parametrize(
    ("method", "many"),
    [
        ("/rpc.v1.Style/Status", False),
        ("/rpc.v1.Style/Train", False),
        ("/rpc.v1.Style/Checkpoint", True),
        ("/grpc.health.v1.Health/Check", False),
        ("/grpc.health.v1.Health/Watch", True),
    ],
)
def test_calls_that_send_no_message_stop_nobody(method: str, many: bool) -> None:
    """More than there are workers: each gives its worker back, and all others are answered."""
    config = ServerConfig(workers=4, message_s=1.0)
    with served(config) as server, grpc.insecure_channel(server.address) as channel:
        # a single message is a stream of one on the wire: a stream of none keeps it open
        call = channel.stream_stream(method) if many else channel.stream_unary(method)
        silent = [call(silence(60)) if many else call.future(silence(60)) for _ in range(6)]
        client = StyleClient(ChannelConfig(server.address, deadline_s=30, retry_s=60))
        assert client.version == 3
        client.close()
        # four silent calls to Checkpoint are all places for streams: health says so while they last
        serving = health_pb2.HealthCheckResponse.SERVING
        assert until(lambda: asked(server.address, NAME) == serving)
        with grpc.insecure_channel(server.address) as other:
            request = health_pb2.HealthCheckRequest(service=NAME)
            watch = health_pb2_grpc.HealthStub(other).Watch(request, timeout=30)
            assert any(reply.status == serving for reply in watch)
            watch.cancel()
        for future in silent:
            if many:
                with pytest.raises(grpc.RpcError) as caught:
                    list(future)
                error = caught.value
            else:
                error = future.exception(timeout=30)
            assert isinstance(error, grpc.RpcError) and error.code() is grpc.StatusCode.CANCELLED
        with pytest.raises(grpc.RpcError, match="message: missing") as caught:
            list(call(iter(()))) if many else call(iter(()))
        assert caught.value.code() is grpc.StatusCode.INVALID_ARGUMENT


def test_a_slow_client_is_ended_in_all() -> None:
    """One message a moment, never silent for long: the sum is bounded."""

    def drops() -> Iterator[pb.ScoreChunk]:
        head = pb.ScoreHeader(batch=9, steps=4, scenes=16, width=7, format=pb.NUMBER_FORMAT_FLOAT32)
        yield pb.ScoreChunk(header=head)
        for _ in range(200):
            time.sleep(0.2)
            yield pb.ScoreChunk(states=bytes(4))

    with (
        served(ServerConfig(idle_s=5, stream_s=1.0)) as server,
        grpc.insecure_channel(server.address) as channel,
    ):
        with pytest.raises(grpc.RpcError) as caught:
            style_pb2_grpc.StyleStub(channel).Score(drops(), timeout=60)
        assert isinstance(caught.value, grpc.Call)
        assert caught.value.code() is grpc.StatusCode.CANCELLED


def test_a_training_s_own_service_is_reached_by_it_alone() -> None:
    spec = ServiceSpec(
        mocap="tests.support.style_cases:make_mocap", style=SMALL, server=ServerConfig(token="own")
    )
    process = start_process(spec)
    try:
        for token in ("", "guess"):
            with pytest.raises(RefusedError, match="authorization: must be 'Bearer"):
                StyleClient(ChannelConfig(process.address, token=token, retry_s=20))
        client = StyleClient(ChannelConfig(process.address, token="own", retry_s=20))
        assert client.version == 0
        client.close()
        assert "own" not in repr(ServerConfig(token="own")) + repr(ChannelConfig(token="own"))
    finally:
        process.stop()


def test_a_stranger_s_rollout_never_enters_a_training(server: Server) -> None:
    def client(training: str) -> StyleClient:
        return StyleClient(ChannelConfig(server.address, retry_s=20), training=training)

    mine, stranger, nobody = client("mine"), client("other"), client("")
    fresh = trained()
    try:
        mine.load_state_dict(fresh.state_dict())
        for other in (stranger, nobody):
            with pytest.raises(TurnError, match="belongs to another training"):
                other.score(3, **rollout(8))
            with pytest.raises(TurnError, match="belongs to another training"):
                other.train(3)
        assert torch.equal(mine.score(3, **rollout(3)).reward, fresh.score(3, **rollout(3)).reward)
        assert mine.train(3) == fresh.train(3)
        assert_equal_states(mine.state_dict(), fresh.state_dict())
        for other in (stranger, nobody):
            with pytest.raises(TurnError, match="start a service for each"):
                other.load_state_dict(trained().state_dict())
        again = client("mine")  # as a training that resumes
        again.load_state_dict(fresh.state_dict())
        assert torch.equal(again.score(4, **rollout(4)).reward, fresh.score(4, **rollout(4)).reward)
        again.close()
    finally:
        for one in (mine, stranger, nobody):
            one.close()
