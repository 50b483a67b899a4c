"""HOST:PORT of pages that are served on this machine."""

import socket

import pytest

from console.listening import address_of, family, is_loopback
from world.errors import ConfigError


def test_addresses() -> None:
    assert address_of("127.0.0.1:8080") == ("127.0.0.1", 8080)
    assert address_of("[::1]:0") == ("::1", 0)
    for wrong in ("8080", ":8080", "host:", "host:x", "host:65536"):
        with pytest.raises(ConfigError, match="must be HOST:PORT"):
            address_of(wrong)


def test_what_only_this_machine_reaches() -> None:
    assert all(map(is_loopback, ("127.0.0.1", "::1", "localhost")))
    assert not any(map(is_loopback, ("0.0.0.0", "example.org", "10.1.2.3")))


def test_ipv6_has_its_own_family_and_brackets() -> None:
    assert family("::1") == socket.AF_INET6
    assert family("localhost") == family("127.0.0.1") == socket.AF_INET
    with pytest.raises(ConfigError, match=r"cannot listen on '::1:80': write IPv6 in brackets"):
        address_of("::1:80")
