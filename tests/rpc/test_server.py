"""The server's shell and the client's channel, over real loopback connections."""

import socket
import time
import urllib.request
from pathlib import Path
from typing import Any

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2, reflection_pb2_grpc

from rpc.channel import Channel, ChannelConfig
from rpc.errors import RpcError
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc
from tests.support.rpc.process import printed
from tests.support.rpc.services import NAME, serving, status


def test_health_reflection_and_metrics() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with serving(ServerConfig(metrics=f"127.0.0.1:{port}")) as (server, _):
        assert status(ChannelConfig(server.address)) == 7
        with grpc.insecure_channel(server.address) as channel:
            request = health_pb2.HealthCheckRequest(service=NAME)
            assert health_pb2_grpc.HealthStub(channel).Check(request).status == 1
            ask = reflection_pb2.ServerReflectionRequest(list_services="")
            (answer,) = reflection_pb2_grpc.ServerReflectionStub(channel).ServerReflectionInfo(
                iter([ask])
            )
            assert NAME in [s.name for s in answer.list_services_response.service]
        page = urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics").read().decode()
        assert 'rpc_calls_total{code="OK",method="/rpc.v1.Style/Status"} 1.0' in page
        second = Server(ServerConfig(metrics=f"127.0.0.1:{port}"))
        with pytest.raises(RpcError, match="metrics: cannot listen"):
            second.start([])


def test_other_machines_need_protection(tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("x")
    for config in (
        ServerConfig(listen="0.0.0.0:0"),
        ServerConfig(listen="0.0.0.0:0", token_file=str(token)),
        ServerConfig(listen="[::]:0"),
    ):
        with pytest.raises(RpcError, match="open to other machines"):
            Server(config)
    with serving(ServerConfig(listen="0.0.0.0:0", allow_insecure_remote=True)) as (server, _):
        assert status(ChannelConfig(server.address.replace("0.0.0.0", "127.0.0.1"))) == 7
    with pytest.raises(RpcError, match="not shown to another machine"):
        Channel(ChannelConfig("10.0.0.1:1", token_file=str(token)), "service")


def test_a_port_in_use_is_one_line() -> None:
    in_use = pytest.raises(RpcError, match="Address already in use; choose another port")
    with serving(ServerConfig()) as (server, _), in_use:
        Server(ServerConfig(listen=server.address))
    for wrong in ("localhost", "127.0.0.1:99999", ":7"):
        with pytest.raises(RpcError, match="must be HOST:PORT"):
            Server(ServerConfig(listen=wrong))


def test_a_unix_socket_serves_too(tmp_path: Path) -> None:
    with serving(ServerConfig(listen=f"unix:{tmp_path}/s")) as (server, _):
        assert status(ChannelConfig(server.address)) == 7


def test_drain_lets_calls_end_and_takes_no_more() -> None:
    with (
        serving(ServerConfig()) as (server, answers),
        grpc.insecure_channel(server.address) as channel,
    ):
        stub = style_pb2_grpc.StyleStub(channel)
        call = stub.Train.future(pb.TrainRequest(version=5))
        assert answers.entered.wait(10)
        server.drain()
        assert call.result().version == 5
        with pytest.raises(grpc.RpcError):
            stub.Status(pb.StatusRequest(), timeout=2)


def test_sigterm_drains_a_process_from_the_moment_it_is_announced() -> None:
    """The signal comes as the address is told: by then it is handled."""
    code = (
        "import os, signal\n"
        "from rpc.server import Server, ServerConfig\n"
        "s = Server(ServerConfig()); s.start([])\n"
        "first = s.run(started=lambda: os.kill(os.getpid(), signal.{}))\n"
        "print('Ctrl-C' if first else 'SIGTERM', s.stopping.is_set())\n"
    )
    for name, told in (("SIGTERM", "SIGTERM True"), ("SIGINT", "Ctrl-C True")):
        assert printed(code.format(name)) == told


def test_a_second_ctrl_c_ends_a_drain_at_once() -> None:
    """A watch of the health is a call in progress: the drain waits for it."""
    code = (
        "import os, signal, grpc, time\n"
        "from grpc_health.v1 import health_pb2, health_pb2_grpc\n"
        "from rpc.server import Server, ServerConfig\n"
        "s = Server(ServerConfig(drain_s=60)); s.start([])\n"
        "channel = grpc.insecure_channel(s.address)\n"
        "watch = health_pb2_grpc.HealthStub(channel).Watch(health_pb2.HealthCheckRequest())\n"
        "def press(*_): print(time.monotonic(), flush=True); os.kill(os.getpid(), signal.SIGINT)\n"
        "def started(): next(watch); os.kill(os.getpid(), signal.{})\n"
        "signal.signal(signal.SIGALRM, press)\n"
        "s.run(lambda line: signal.alarm(2), started)\n"
    )
    for first in ("SIGINT", "SIGTERM"):
        pressed = printed(code.format(first), ends_with=130)
        assert time.monotonic() - float(pressed) < 10.0


def test_a_client_may_ping_during_a_long_call() -> None:
    """By default a server closes a connection after three pings without data: a training of the
    discriminator that took longer than 20 s was never answered."""

    class Long(style_pb2_grpc.StyleServicer):
        def Status(self, request: pb.StatusRequest, context: grpc.ServicerContext) -> Any:
            time.sleep(9)
            return pb.StatusReply(version=7)

    pings = [("grpc.keepalive_time_ms", 1_500), ("grpc.http2.max_pings_without_data", 0)]
    server = Server(ServerConfig())
    style_pb2_grpc.add_StyleServicer_to_server(Long(), server.grpc)
    server.start([NAME])
    try:
        with grpc.insecure_channel(server.address, pings) as channel:
            assert style_pb2_grpc.StyleStub(channel).Status(pb.StatusRequest()).version == 7
    finally:
        server.drain()
