"""TLS, mutual TLS and tokens."""

from pathlib import Path

import pytest

from rpc.channel import ChannelConfig
from rpc.errors import RpcError, UnreachableError
from rpc.server import Server, ServerConfig
from tests.support.rpc.certificates import certificates
from tests.support.rpc.services import serving, status


def test_tls_and_mutual_tls(tmp_path: Path) -> None:
    files = certificates(tmp_path)
    config = ServerConfig(
        listen="localhost:0", tls_cert=files["server.crt"], tls_key=files["server.key"]
    )
    with serving(config) as (server, _):
        assert status(ChannelConfig(server.address, tls_ca=files["ca.crt"])) == 7
        with pytest.raises(UnreachableError):
            status(ChannelConfig(server.address, retry_s=0.5))
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
            status(ChannelConfig(server.address, tls_ca=files["ca.crt"], retry_s=0.5))
    with pytest.raises(RpcError, match="give both or neither"):
        Server(ServerConfig(tls_cert=files["server.crt"]))
