"""The client's channel: it waits for a service that is away, and gives up in the end."""

import os
import socket
import subprocess
import sys
import threading

import pytest

from rpc.channel import Channel, ChannelConfig
from rpc.errors import UnreachableError
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc
from tests.support.rpc.services import NAME, Answers, status


def test_a_client_waits_for_a_service_and_gives_up_in_the_end() -> None:
    said: list[str] = []
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"127.0.0.1:{free.getsockname()[1]}"
    channel = Channel(ChannelConfig(address, retry_s=20), "service", said.append)
    stub = style_pb2_grpc.StyleStub(channel.grpc)
    servers: list[Server] = []

    def later() -> None:
        server = Server(ServerConfig(listen=address))
        style_pb2_grpc.add_StyleServicer_to_server(Answers(), server.grpc)
        server.start([NAME])
        servers.append(server)

    timer = threading.Timer(1.0, later)
    timer.start()
    reply = channel.call(lambda timeout, _: stub.Status(pb.StatusRequest(), timeout=timeout))
    assert reply.version == 7
    assert [line.split(":")[0] for line in said if "away" in line] == [
        f"service at {address.split(':')[0]}"
    ]
    assert len(said) == 2
    assert "back after" in said[1]
    channel.close()
    timer.join()
    servers[0].drain()
    with pytest.raises(UnreachableError, match=f"service at {address} did not answer"):
        status(ChannelConfig(address, retry_s=0.5))


def test_fork_support_is_off_unless_the_environment_sets_it() -> None:
    code = "import os, rpc; print(os.environ['GRPC_ENABLE_FORK_SUPPORT'])"
    for given, found in (({}, "0"), ({"GRPC_ENABLE_FORK_SUPPORT": "1"}, "1")):
        environment = {k: v for k, v in os.environ.items() if not k.startswith("GRPC_")} | given
        environment["PYTHONPATH"] = os.pathsep.join(sys.path)
        done = subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, text=True
        )
        assert done.stdout.strip() == found
