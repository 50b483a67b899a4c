"""States that do not fit a discriminator: refused in one line, and nothing changes."""

from collections.abc import Callable, Iterator

import grpc
import pytest
import torch
from torch import Tensor

from discriminator.client import StyleClient
from discriminator.errors import StyleError
from discriminator.messages import state_chunks
from discriminator.service import start
from discriminator.trainer import Discriminator
from rpc.channel import ChannelConfig
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc
from tests.support.style_cases import SMALL, Mocap, assert_equal_states, trained
from world.errors import LayoutError

State = dict[str, Tensor]


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
    found = start(trained(), ServerConfig(drain_s=0.0))
    yield found
    found.drain()


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


def test_chunks_of_a_state_say_their_size() -> None:
    state = trained().state_dict()
    assert sum(v.numel() * v.element_size() for v in state.values()) < trained().state_bytes
    assert len(list(state_chunks(state))) > len(state)
