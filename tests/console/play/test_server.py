"""Where the player's page may be: addresses, and nowhere but here unless that is allowed."""

import socket

import pytest

from console.play.server import start
from world.errors import ConfigError


def test_foreign_hosts_are_refused_and_a_taken_port_is_one_line() -> None:
    with pytest.raises(ConfigError, match="the page has no authentication"):
        start("0.0.0.0:0")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        line = f"^cannot listen on '127.0.0.1:{port}': Address already in use; choose another port "
        with pytest.raises(ConfigError, match=line):
            start(f"127.0.0.1:{port}")
