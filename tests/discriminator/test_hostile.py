"""The style service against states that do not fit, silent streams, and strangers."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import grpc
import pytest
import torch
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2_grpc
from torch import Tensor

from discriminator.client import StyleClient
from discriminator.errors import StyleError, TurnError
from discriminator.messages import state_chunks
from discriminator.process import ServiceSpec, start_process
from discriminator.service import NAME, start
from discriminator.trainer import Discriminator
from rpc.channel import ChannelConfig
from rpc.errors import RefusedError
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc
from tests.support.style_cases import SMALL, Mocap, assert_equal_states, rollout
from world.errors import LayoutError

State = dict[str, Tensor]


def trained(trainings: int = 3) -> Discriminator:
    style = Discriminator(SMALL, Mocap(), 0)
    for k in range(trainings):
        style.score(k, **rollout(k))
        style.train(k)
    return style


@contextmanager
def served(config: ServerConfig, style: Discriminator | None = None) -> Iterator[Server]:
    server = start(style or trained(), config)
    try:
        yield server
    finally:
        server.config = replace(config, drain_s=0.0)
        server.drain()


def put(name: str, change: Callable[[Tensor], Tensor]) -> Callable[[State], State]:
    return lambda state: state | {name: change(state[name])}


def without(prefix: str) -> Callable[[State], State]:
    return lambda state: {k: v for k, v in state.items() if not k.startswith(prefix)}


WRONG: dict[str, Callable[[State], State]] = {
    "moments of another shape": put("adam/0/exp_avg", lambda t: t[:1]),
    "moments of one number": put("adam/0/exp_avg_sq", lambda t: t.flatten()[:1]),
    "moments of another type": put("adam/1/exp_avg", Tensor.double),
    "squares below 0": put("adam/0/exp_avg_sq", lambda t: t - 1),
    "moments that are no numbers": put("adam/2/exp_avg", lambda t: t * torch.nan),
    "moments of some parameters": without("adam/1/"),
    "no moments after trainings": without("adam/"),
    "moments of a parameter too many": lambda s: s | {"adam/99/step": torch.tensor(6.0)},
    "a moment of no kind": lambda s: s | {"adam/0/max": torch.zeros(1)},
    "a step that is a vector": put("adam/0/step", lambda t: t.repeat(3)),
    "a step of another type": put("adam/0/step", Tensor.long),
    "a step that does not fit": put("adam/0/step", lambda t: t + 1),
    "a step below 0": put("adam/0/step", lambda t: -t),
    "weights that are no numbers": put("network/layers.0.weight", lambda t: t / 0),
    "weights of another type": put("network/layers.0.weight", Tensor.half),
    "no deviation": put("normaliser/deviation", torch.zeros_like),
    "a version below 0": put("counters/version", lambda t: t - 100),
    "a count that is a fraction": put("counters/batches", Tensor.float),
    "a count that is a vector": put("counters/seed", lambda t: t.repeat(2)),
    "a replay below 0": put("counters/replay", lambda t: -t),
    "a replay larger than it is": put("counters/replay", lambda t: t + 1),
    "rows of whole numbers": put("new", Tensor.long),
    "rows that are no numbers": put("replay", lambda t: t * torch.inf),
    "scores of no shape": put("scores/0/reward", Tensor.flatten),
    "scores of another type": put("scores/0/reward", Tensor.double),
    "a score of too many": lambda s: s | {"scores/99/id": torch.tensor([1, 1])},
    "a figure that is a vector": put("trained/style/loss", lambda t: t.repeat(2)),
    "a part of no kind": lambda s: s | {"other": torch.zeros(1)},
}


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with served(ServerConfig()) as found:
        yield found


@pytest.mark.parametrize("name", WRONG)
def test_a_state_that_does_not_fit_changes_nothing(name: str, server: Server) -> None:
    client = StyleClient(ChannelConfig(server.address, retry_s=20))
    try:
        before = client.state_dict()
        wrong = WRONG[name](dict(before))
        with pytest.raises(LayoutError, match=r"^discriminator state: "):
            Discriminator(SMALL, Mocap(), 0).load_state_dict(wrong)
        with pytest.raises(StyleError, match=r"^discriminator state: [^\n]*$"):
            client.load_state_dict(wrong)
        assert_equal_states(client.state_dict(), before)
        client.load_state_dict(before)  # the right one is taken, and it goes on
        assert_equal_states(client.state_dict(), before)
    finally:
        client.close()


def test_a_state_is_bounded_in_all(server: Server) -> None:
    """Each tensor within its bound, all of them together not: refused before it is sent."""

    def chunks() -> Iterator[pb.StateChunk]:
        yield pb.StateChunk(header=pb.StateHeader(tensors=9))
        for index in range(9):
            head = pb.TensorHeader(name=f"a{index}", format="<f4", shape=(1 << 27,))
            yield pb.StateChunk(tensor=head)

    with grpc.insecure_channel(server.address) as channel:
        stub = style_pb2_grpc.StyleStub(channel)
        with pytest.raises(grpc.RpcError, match="INVALID_ARGUMENT") as caught:
            stub.Restore(chunks(), timeout=30)
        assert "must be at most" in str(caught.value)
        long = [
            pb.StateChunk(header=pb.StateHeader(tensors=1)),
            pb.StateChunk(tensor=pb.TensorHeader(name="x" * 1000, format="<f4", shape=())),
        ]
        with pytest.raises(grpc.RpcError, match="INVALID_ARGUMENT"):
            stub.Restore(iter(long), timeout=30)


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
        stranger.load_state_dict(trained().state_dict())
        with pytest.raises(TurnError, match="belongs to another training"):
            mine.score(4, **rollout(4))
    finally:
        nobody.load_state_dict(trained().state_dict())
        for one in (mine, stranger, nobody):
            one.close()


def test_chunks_of_a_state_say_their_size() -> None:
    state = trained().state_dict()
    assert sum(v.numel() * v.element_size() for v in state.values()) < trained().state_bytes
    assert len(list(state_chunks(state))) > len(state)
