"""What happens to every call: the token is asked for, errors become statuses."""

import io
from pathlib import Path

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc

from rpc.channel import Channel, ChannelConfig
from rpc.errors import RefusedError, RpcError
from rpc.interceptors import unexpected
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc
from tests.support.rpc.services import serving, status


def test_errors_become_statuses_with_one_line(capfd: pytest.CaptureFixture[str]) -> None:
    with serving(ServerConfig()) as (server, _):
        channel = Channel(ChannelConfig(server.address), "service")
        stub = style_pb2_grpc.StyleStub(channel.grpc)

        def train(version: int) -> None:
            channel.call(
                lambda timeout, _: stub.Train(pb.TrainRequest(version=version), timeout=timeout)
            )

        with pytest.raises(RefusedError, match="must be 1 or more") as caught:
            train(0)
        assert caught.value.code is grpc.StatusCode.INVALID_ARGUMENT
        with pytest.raises(RefusedError, match="KeyError: 'unexpected'") as caught:
            train(1)
        assert caught.value.code is grpc.StatusCode.INTERNAL
        assert "Traceback" in capfd.readouterr().err  # the whole story, on the service's side
        channel.close()


def test_an_unexpected_error_is_told_to_the_caller_when_nobody_reads_tracebacks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As where standard error is a pipe whose reader has ended."""

    class Closed(io.StringIO):
        def write(self, _text: str) -> int:
            raise BrokenPipeError(32, "Broken pipe")

    monkeypatch.setattr("sys.stderr", Closed())
    assert unexpected(KeyError("why")) == "KeyError: 'why'"


def test_a_token_is_required(tmp_path: Path) -> None:
    right, wrong = tmp_path / "right", tmp_path / "wrong"
    right.write_text("s3cret\n")
    wrong.write_text("s3cres\n")
    with serving(ServerConfig(token_file=str(right))) as (server, _):
        assert status(ChannelConfig(server.address, token_file=str(right))) == 7
        for token_file in ("", str(wrong)):
            with pytest.raises(RefusedError) as caught:
                status(ChannelConfig(server.address, token_file=token_file))
            assert caught.value.code is grpc.StatusCode.UNAUTHENTICATED
        with grpc.insecure_channel(server.address) as channel:  # probes carry none
            assert health_pb2_grpc.HealthStub(channel).Check(health_pb2.HealthCheckRequest())
    with pytest.raises(RpcError, match="No such file"):
        Server(ServerConfig(token_file=str(tmp_path / "none")))
