"""Junk, silent connections, and certificates that do not hold."""

import datetime
import socket
import time
from pathlib import Path

import grpc
import pytest

from console.app import main
from rpc import server as servers
from rpc.channel import Channel, ChannelConfig
from rpc.credentials import server_credentials
from rpc.errors import RpcError, UnreachableError
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc
from tests.support.rpc.certificates import certificates


class Echo(style_pb2_grpc.StyleServicer):
    def Train(self, request: pb.TrainRequest, context: object) -> pb.TrainReply:
        if request.version == 7:
            raise RuntimeError("lost: /srv/secret/place.bin")
        return pb.TrainReply(version=request.version)


@pytest.fixture
def address() -> object:
    server = Server(ServerConfig())
    style_pb2_grpc.add_StyleServicer_to_server(Echo(), server.grpc)
    server.start(["rpc.v1.Style"])
    yield server.address
    server.drain()


def test_junk_is_an_invalid_argument_on_a_server_of_threads_too(address: str) -> None:
    with grpc.insecure_channel(address) as channel:
        raw = channel.unary_unary("/rpc.v1.Style/Train")
        for junk in (b"\xff\xff\xff\xff", b"\x08", b"\x0a\xff\xff\x03junk"):
            with pytest.raises(grpc.RpcError) as caught:
                raw(junk, timeout=20)
            assert isinstance(caught.value, grpc.Call)
            assert caught.value.code() is grpc.StatusCode.INVALID_ARGUMENT
            assert "cannot be parsed" in (caught.value.details() or "")
        stub = style_pb2_grpc.StyleStub(channel)
        assert stub.Train(pb.TrainRequest(version=3), timeout=20).version == 3
        with pytest.raises(grpc.RpcError) as caught:
            stub.Train(pb.TrainRequest(version=7), timeout=20)
        assert caught.value.details() == "RuntimeError: lost: place.bin"  # type: ignore[attr-defined]


def test_a_silent_connection_to_the_metrics_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(servers, "METRICS_S", 0.5)
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = found.getsockname()[1]
    server = Server(ServerConfig(metrics=f"127.0.0.1:{port}"))
    server.start([])
    try:
        with socket.create_connection(("127.0.0.1", port), timeout=30) as silent:
            assert silent.recv(1) == b"", "the server has closed it"
        with socket.create_connection(("127.0.0.1", port), timeout=30) as asking:
            asking.sendall(b"GET /metrics HTTP/1.0\r\n\r\n")
            assert asking.recv(15).startswith(b"HTTP/1.0 200")
    finally:
        server.drain()


def test_a_key_of_another_certificate_is_reported_at_once(tmp_path: Path) -> None:
    files = certificates(tmp_path)
    with pytest.raises(RpcError, match="is not that of certificate"):
        server_credentials(files["server.crt"], files["client.key"], "")
    (tmp_path / "junk").write_text("junk")
    with pytest.raises(RpcError, match="not readable as PEM"):
        server_credentials(str(tmp_path / "junk"), files["server.key"], "")


def expired(folder: Path, files: dict[str, str]) -> None:
    """Write the server's certificate anew, of last year."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization

    def key(role: str) -> object:
        return serialization.load_pem_private_key(Path(files[f"{role}.key"]).read_bytes(), None)

    ca = x509.load_pem_x509_certificate(Path(files["ca.crt"]).read_bytes())
    now = datetime.datetime.now(datetime.UTC)
    cert = (
        x509.CertificateBuilder()
        .subject_name(x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "server")]))
        .issuer_name(ca.subject)
        .public_key(key("server").public_key())  # type: ignore[attr-defined]
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=400))
        .not_valid_after(now - datetime.timedelta(days=40))
        .add_extension(x509.SubjectAlternativeName([x509.DNSName("localhost")]), critical=False)
        .sign(key("ca"), hashes.SHA256())  # type: ignore[arg-type]
    )
    Path(files["server.crt"]).write_bytes(cert.public_bytes(serialization.Encoding.PEM))


def why_not(config: ServerConfig, ca: str) -> str:
    server = Server(config)
    style_pb2_grpc.add_StyleServicer_to_server(Echo(), server.grpc)
    server.start(["rpc.v1.Style"])
    channel = Channel(ChannelConfig(server.address, tls_ca=ca, retry_s=60), "service")
    try:
        stub = style_pb2_grpc.StyleStub(channel.grpc)
        began = time.monotonic()
        with pytest.raises(UnreachableError) as caught:
            channel.call(lambda timeout, _: stub.Train(pb.TrainRequest(version=1), timeout=timeout))
        assert time.monotonic() - began < 50, "it does not wait for what waiting does not mend"
        return str(caught.value)
    finally:
        channel.close()
        server.drain()


def test_expired_and_unknown_certificates_are_reported_as_such(tmp_path: Path) -> None:
    files = certificates(tmp_path)
    config = ServerConfig(
        listen="localhost:0", tls_cert=files["server.crt"], tls_key=files["server.key"]
    )
    (tmp_path / "other").mkdir()
    others = certificates(tmp_path / "other")
    said = why_not(config, others["ca.crt"])
    assert "certificate is" in said and "tls_ca" in said
    expired(tmp_path, files)
    assert "its certificate has expired: renew it" in why_not(config, files["ca.crt"])


def test_doctor_remarks_a_token_that_others_can_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from console.doctor.command import check_token

    token = tmp_path / "token"
    token.write_text("s3cret")
    token.chmod(0o644)
    found = check_token(token)
    assert found.verdict == "mind" and "others can read it (644)" in found.detail
    token.chmod(0o600)
    assert check_token(token).verdict == "ok"


def test_motions_play_stays_on_this_machine(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["motions", "play", "--listen", "0.0.0.0:0", "--only", "sit"]) == 2
    assert "the page has no authentication" in capsys.readouterr().err
