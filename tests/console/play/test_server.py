"""Where the player's page may be: addresses, and nowhere but here unless that is allowed."""

import socket

import pytest

from console.play.server import address_of, is_loopback, start
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


def test_others_are_refused_and_a_taken_port_is_said() -> None:
    with pytest.raises(ConfigError, match="anyone there could play"):
        start("0.0.0.0:0")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ConfigError, match=f"cannot listen on '127.0.0.1:{port}'"):
            start(f"127.0.0.1:{port}")
