"""Addresses: host and port, and whether they stay on this machine."""

import pytest

from rpc.address import is_local, split_address
from rpc.errors import RpcError


def test_host_and_port() -> None:
    assert split_address("127.0.0.1:50051") == ("127.0.0.1", 50051)
    assert split_address("[::1]:0") == ("::1", 0)
    assert split_address("a.b:65535") == ("a.b", 65535)


@pytest.mark.parametrize("wrong", ["", "8080", ":8080", "host:", "host:-1", "host:65536", "h:x"])
def test_anything_else_is_refused_with_the_form(wrong: str) -> None:
    with pytest.raises(RpcError, match=r"must be HOST:PORT with a port of 0\.\.65535"):
        split_address(wrong)


def test_only_the_loopback_and_sockets_are_local() -> None:
    for address in ("unix:/tmp/s", "localhost:1", "127.3.2.1:1", "[::1]:1"):
        assert is_local(address), address
    for address in ("0.0.0.0:1", "[::]:1", "10.0.0.1:1", "localhost.evil.org:1"):
        assert not is_local(address), address
