"""The server's shell and the client's channel, over real loopback connections."""

import datetime
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2, reflection_pb2_grpc

from rpc.channel import Channel, ChannelConfig
from rpc.errors import CodecError, RefusedError, RpcError, UnreachableError
from rpc.generate import ROOT, generate
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc

NAME = "rpc.v1.Style"


class Answers(style_pb2_grpc.StyleServicer):
    """A service with one call of each outcome."""

    def __init__(self) -> None:
        self.entered = threading.Event()

    def Status(self, request: pb.StatusRequest, context: grpc.ServicerContext) -> pb.StatusReply:
        return pb.StatusReply(version=7)

    def Train(self, request: pb.TrainRequest, context: grpc.ServicerContext) -> pb.TrainReply:
        if request.version == 0:
            raise CodecError("version: 0, must be 1 or more")
        if request.version == 1:
            raise KeyError("unexpected")
        self.entered.set()
        time.sleep(0.5)
        return pb.TrainReply(version=request.version)


@contextmanager
def serving(config: ServerConfig) -> Iterator[tuple[Server, Answers]]:
    server, answers = Server(config), Answers()
    style_pb2_grpc.add_StyleServicer_to_server(answers, server.grpc)
    server.start([NAME])
    try:
        yield server, answers
    finally:
        server.drain()


def status(config: ChannelConfig) -> int:
    channel = Channel(config, "service")
    stub = style_pb2_grpc.StyleStub(channel.grpc)
    try:
        return channel.call(
            lambda timeout, metadata: stub.Status(
                pb.StatusRequest(), timeout=timeout, metadata=metadata
            )
        ).version
    finally:
        channel.close()


def test_committed_stubs_are_those_of_the_proto(tmp_path: Path) -> None:
    pytest.importorskip("grpc_tools")
    generate(tmp_path)
    made = {p.name: p.read_text() for p in (tmp_path / "rpc/v1").iterdir()}
    kept = {p.name: p.read_text() for p in (ROOT / "rpc/v1").glob("*_pb2*.py*")}
    assert made == kept, "run `make proto`"


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


def test_a_token_is_asked_for(tmp_path: Path) -> None:
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


def test_a_port_in_use_is_said_in_one_line() -> None:
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


def test_a_client_waits_for_a_service_and_gives_up_in_the_end() -> None:
    said: list[str] = []
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"127.0.0.1:{free.getsockname()[1]}"
    channel = Channel(ChannelConfig(address, patience_s=20), "service", said.append)
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
        status(ChannelConfig(address, patience_s=0.5))


def test_sigterm_drains_a_process() -> None:
    code = (
        "from rpc.server import Server, ServerConfig\n"
        "s = Server(ServerConfig()); s.start([]); print(s.address, flush=True); s.run()\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        text=True,
        env=dict(os.environ, PYTHONPATH=os.pathsep.join(sys.path)),
    )
    assert process.stdout is not None
    assert process.stdout.readline()
    time.sleep(0.3)
    process.send_signal(signal.SIGTERM)
    assert process.wait(15) == 0
    process.stdout.close()


def certificates(directory: Path) -> dict[str, str]:
    """An authority, and a certificate of it for localhost; file names by role."""
    x509 = pytest.importorskip("cryptography.x509")
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    now = datetime.datetime.now(datetime.UTC)

    def write(role: str, issuer: tuple | None) -> tuple:
        key = ec.generate_private_key(ec.SECP256R1())
        name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, role)])
        signer, signer_name = issuer or (key, name)
        builder = (
            x509.CertificateBuilder()
            .subject_name(name)
            .issuer_name(signer_name)
            .public_key(key.public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - datetime.timedelta(days=1))
            .not_valid_after(now + datetime.timedelta(days=1))
            .add_extension(x509.BasicConstraints(issuer is None, None), critical=True)
            .add_extension(x509.SubjectAlternativeName([x509.DNSName("localhost")]), critical=False)
        )
        cert = builder.sign(signer, hashes.SHA256())
        pem = serialization.Encoding.PEM
        (directory / f"{role}.crt").write_bytes(cert.public_bytes(pem))
        (directory / f"{role}.key").write_bytes(
            key.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
        )
        return key, name

    authority = write("ca", None)
    for role in ("server", "client"):
        write(role, authority)
    return {p.name: str(p) for p in directory.iterdir()}


def test_tls_and_mutual_tls(tmp_path: Path) -> None:
    files = certificates(tmp_path)
    config = ServerConfig(
        listen="localhost:0", tls_cert=files["server.crt"], tls_key=files["server.key"]
    )
    with serving(config) as (server, _):
        assert status(ChannelConfig(server.address, tls_ca=files["ca.crt"])) == 7
        with pytest.raises(UnreachableError):
            status(ChannelConfig(server.address, patience_s=0.5))
    mutual = ServerConfig(
        listen="localhost:0",
        tls_cert=files["server.crt"],
        tls_key=files["server.key"],
        tls_client_ca=files["ca.crt"],
    )
    with serving(mutual) as (server, _):
        ours = {"tls_cert": files["client.crt"], "tls_key": files["client.key"]}
        assert status(ChannelConfig(server.address, tls_ca=files["ca.crt"], **ours)) == 7
        with pytest.raises(UnreachableError):
            status(ChannelConfig(server.address, tls_ca=files["ca.crt"], patience_s=0.5))
    with pytest.raises(RpcError, match="give both or neither"):
        Server(ServerConfig(tls_cert=files["server.crt"]))
