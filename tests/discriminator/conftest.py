"""What the tests of discriminator share."""

from collections.abc import Iterator

import pytest

from discriminator.client import StyleClient
from discriminator.service import start
from discriminator.trainer import Discriminator
from rpc.channel import ChannelConfig
from rpc.server import Server, ServerConfig
from tests.support.style_cases import SMALL, Mocap


@pytest.fixture
def server() -> Iterator[Server]:
    server = start(Discriminator(SMALL, Mocap(), 0), ServerConfig())
    yield server
    server.drain()


@pytest.fixture
def client(server: Server) -> Iterator[StyleClient]:
    client = StyleClient(ChannelConfig(server.address, retry_s=20))
    yield client
    client.close()
