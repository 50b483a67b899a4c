"""Addresses: host and port, and whether they stay on this machine."""

import pytest

from rpc.address import is_local, joined, split_address
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


@pytest.mark.parametrize("wrong", ["::1:8080", "[::1:8080", "::1]:8080", "fe80::1:1"])
def test_ipv6_is_in_brackets(wrong: str) -> None:
    with pytest.raises(RpcError, match=r"write IPv6 in brackets, as \[::1\]:"):
        split_address(wrong)


def test_joined_is_split_again() -> None:
    for address in ("127.0.0.1:1", "[::1]:50051", "a.b:0"):
        assert joined(*split_address(address)) == address
    assert is_local("[::ffff:127.0.0.1]:1") and not is_local("[::ffff:10.0.0.1]:1")
