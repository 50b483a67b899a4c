"""Health as the health service says it: serving, starting, unknown, away."""

import pytest

from rpc.channel import ChannelConfig
from rpc.errors import RpcError
from rpc.probe import check_health
from rpc.server import ServerConfig
from tests.support.rpc.services import NAME, serving


def test_each_status_has_its_own_message() -> None:
    with serving(ServerConfig()) as (server, _):
        config = ChannelConfig(server.address)
        assert check_health(config) > 0.0 and check_health(config, NAME) > 0.0
        with pytest.raises(RpcError, match=r"serves no rpc\.v1\.Other: is the address right\?"):
            check_health(config, "rpc.v1.Other")
    with pytest.raises(RpcError, match=r"does not answer \((UNAVAILABLE|DEADLINE_EXCEEDED)\)"):
        check_health(config, timeout_s=1.0)
