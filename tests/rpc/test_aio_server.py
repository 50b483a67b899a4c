"""The server's shell on an event loop: protection, metrics, statuses, over loopback."""

import asyncio
import socket
import time
import urllib.request
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2, reflection_pb2_grpc

from rpc.aio_server import AioServer
from rpc.credentials import channel_credentials
from rpc.errors import CodecError, RefusedError, RpcError
from rpc.server import ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc
from tests.support.rpc.certificates import certificates
from tests.support.rpc.process import printed

NAME = "rpc.v1.Style"
Code = grpc.StatusCode


class Answers(style_pb2_grpc.StyleServicer):
    """A service with one call of each outcome."""

    async def Status(self, request: pb.StatusRequest, context: Any) -> pb.StatusReply:
        return pb.StatusReply(version=7)

    async def Train(self, request: pb.TrainRequest, context: Any) -> pb.TrainReply:
        if request.version == 0:
            raise CodecError("version: 0, must be 1 or more")
        if request.version == 1:
            raise KeyError("unexpected")
        if request.version == 2:
            raise RefusedError(Code.RESOURCE_EXHAUSTED, "too much")
        await asyncio.sleep(30)
        return pb.TrainReply(version=request.version)

    async def Checkpoint(self, request: pb.CheckpointRequest, context: Any) -> None:
        await context.write(pb.StateChunk(header=pb.StateHeader(tensors=0)))


@asynccontextmanager
async def serving(config: ServerConfig) -> AsyncIterator[AioServer]:
    server = AioServer(config)
    server.add(style_pb2_grpc.add_StyleServicer_to_server, Answers())
    await server.start([NAME])
    try:
        yield server
    finally:
        await server.drain()


async def refused(call: Any) -> tuple[Code, str]:
    with pytest.raises(grpc.aio.AioRpcError) as caught:
        await call
    return caught.value.code(), caught.value.details() or ""


async def reflected(channel: grpc.aio.Channel) -> list[str]:
    ask = reflection_pb2.ServerReflectionRequest(list_services="")
    stub = reflection_pb2_grpc.ServerReflectionStub(channel)
    found = []
    async for answer in stub.ServerReflectionInfo(iter([ask])):
        found += [s.name for s in answer.list_services_response.service]
    return found


def test_statuses_metrics_health_and_reflection(capfd: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        metrics = f"127.0.0.1:{free.getsockname()[1]}"

    async def main() -> str:
        config = ServerConfig(metrics=metrics, drain_s=1)
        async with serving(config) as server, grpc.aio.insecure_channel(server.address) as channel:
            stub = style_pb2_grpc.StyleStub(channel)
            assert (await stub.Status(pb.StatusRequest())).version == 7
            assert len([chunk async for chunk in stub.Checkpoint(pb.CheckpointRequest())]) == 1
            found = [await refused(stub.Train(pb.TrainRequest(version=v))) for v in range(3)]
            assert [code for code, _ in found] == [
                Code.INVALID_ARGUMENT, Code.INTERNAL, Code.RESOURCE_EXHAUSTED,
            ]  # fmt: skip
            assert found[1][1] == "KeyError: 'unexpected'"
            late = await refused(stub.Train(pb.TrainRequest(version=9), timeout=0.2))
            assert late[0] is Code.DEADLINE_EXCEEDED
            assert NAME in await reflected(channel)
            request = health_pb2.HealthCheckRequest(service=NAME)
            assert (await health_pb2_grpc.HealthStub(channel).Check(request)).status == 1
            await asyncio.sleep(0.1)
            page = await asyncio.to_thread(urllib.request.urlopen, f"http://{metrics}/metrics")
            return page.read().decode()

    page = asyncio.run(main())
    assert 'rpc_calls_total{code="OK",method="/rpc.v1.Style/Status"} 1.0' in page
    assert 'rpc_calls_total{code="INTERNAL",method="/rpc.v1.Style/Train"} 1.0' in page
    assert 'rpc_calls_total{code="DEADLINE_EXCEEDED",method="/rpc.v1.Style/Train"} 1.0' in page
    assert 'rpc_seconds_count{method="/rpc.v1.Style/Train"} 4.0' in page
    assert "Traceback" in capfd.readouterr().err


def test_every_method_but_health_requires_the_token(tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("s3cret\n")

    async def main() -> None:
        config = ServerConfig(token_file=str(token))
        async with serving(config) as server, grpc.aio.insecure_channel(server.address) as channel:
            stub = style_pb2_grpc.StyleStub(channel)
            right = (("authorization", "Bearer s3cret"),)
            assert (await stub.Status(pb.StatusRequest(), metadata=right)).version == 7
            for wrong in ((), (("authorization", "Bearer s3cres"),), (("authorization", ""),)):
                code, said = await refused(stub.Status(pb.StatusRequest(), metadata=wrong))
                assert code is Code.UNAUTHENTICATED and "must be 'Bearer" in said
            with pytest.raises(grpc.aio.AioRpcError):
                await reflected(channel)
            request = health_pb2.HealthCheckRequest()
            assert (await health_pb2_grpc.HealthStub(channel).Check(request)).status == 1

    asyncio.run(main())


def test_other_machines_need_protection(tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("x")
    files = certificates(tmp_path)
    tls = {"tls_cert": files["server.crt"], "tls_key": files["server.key"]}

    async def bound(config: ServerConfig) -> str:
        server = AioServer(config)
        await server.grpc.stop(0)
        return server.address

    for bare in (
        ServerConfig(listen="0.0.0.0:0"),
        ServerConfig(listen="0.0.0.0:0", token_file=str(token)),
        ServerConfig(listen="[::]:0"),
        ServerConfig(listen="0.0.0.0:0", **tls),
    ):
        with pytest.raises(RpcError, match="open to other machines"):
            asyncio.run(bound(bare))
    assert asyncio.run(bound(ServerConfig(listen="0.0.0.0:0", token_file=str(token), **tls)))
    assert asyncio.run(bound(ServerConfig(listen="0.0.0.0:0", allow_insecure_remote=True)))


def test_tls_and_mutual_tls(tmp_path: Path) -> None:
    files = certificates(tmp_path)
    tls = {"tls_cert": files["server.crt"], "tls_key": files["server.key"]}

    async def status(address: str, cert: str = "", key: str = "") -> int:
        credentials = channel_credentials(files["ca.crt"], cert, key)
        async with grpc.aio.secure_channel(address, credentials) as channel:
            stub = style_pb2_grpc.StyleStub(channel)
            return (await stub.Status(pb.StatusRequest(), timeout=3)).version

    async def main() -> None:
        async with serving(ServerConfig(listen="localhost:0", **tls)) as server:
            assert await status(server.address) == 7
        mutual = ServerConfig(listen="localhost:0", tls_client_ca=files["ca.crt"], **tls)
        async with serving(mutual) as server:
            assert await status(server.address, files["client.crt"], files["client.key"]) == 7
            assert (await refused(status(server.address)))[0] is Code.UNAVAILABLE

    asyncio.run(main())


def test_signals_are_handled_before_the_server_is_announced() -> None:
    """As `serve` does it: signals are caught, and then the address is told."""
    code = (
        "import os, signal\n"
        "from rpc.aio_server import AioServer, run\n"
        "from rpc.server import ServerConfig\n"
        "async def main():\n"
        "    server = AioServer(ServerConfig()); await server.start([])\n"
        "    server.catch_signals(); os.kill(os.getpid(), signal.{})\n"
        "    first = await server.wait(); await server.drain(); return first\n"
        "print('Ctrl-C' if run(main()) else 'SIGTERM')\n"
    )
    for name, told in (("SIGTERM", "SIGTERM"), ("SIGINT", "Ctrl-C")):
        assert printed(code.format(name)) == told


def test_a_second_ctrl_c_ends_a_drain_at_once() -> None:
    """A watch of the health is a call in progress: the drain waits for it."""
    code = (
        "import asyncio, grpc, os, signal, time\n"
        "from grpc_health.v1 import health_pb2, health_pb2_grpc\n"
        "from rpc.aio_server import AioServer, run\n"
        "from rpc.server import ServerConfig\n"
        "def press(): print(time.monotonic(), flush=True); os.kill(os.getpid(), signal.SIGINT)\n"
        "async def main():\n"
        "    server = AioServer(ServerConfig(drain_s=60)); await server.start([])\n"
        "    channel = grpc.aio.insecure_channel(server.address)\n"
        "    ask = health_pb2.HealthCheckRequest()\n"
        "    watch = health_pb2_grpc.HealthStub(channel).Watch(ask); await watch.read()\n"
        "    server.catch_signals(); os.kill(os.getpid(), signal.{})\n"
        "    await server.wait(); asyncio.get_running_loop().call_later(2, press)\n"
        "    await server.drain()\n"
        "run(main())\n"
    )
    for first in ("SIGINT", "SIGTERM"):
        pressed = printed(code.format(first), ends_with=130)
        assert time.monotonic() - float(pressed) < 10.0
