"""A served policy: what its actions mean, and what cannot be served."""

from dataclasses import replace
from pathlib import Path

import pytest

from policy.errors import LayoutError
from rpc.errors import RpcError
from rpc.server import ServerConfig
from tests.support.policy_cases import (
    fixed,
    make,
    running,
)


def test_a_policy_that_cannot_be_served_is_refused_at_the_start(tmp_path: Path) -> None:
    served = make()
    broken = {
        k: v * float("nan") if k.endswith("0.weight") else v for k, v in served.weights.items()
    }
    with pytest.raises(LayoutError, match="not finite"):
        replace(served, weights=broken).check()
    sources = [fixed(served), fixed(served)]
    with pytest.raises(Exception, match="each needs a name of its own"), running(sources):
        pass
    remote = ServerConfig(listen="0.0.0.0:0")
    with pytest.raises(RpcError, match="open to other"), running([fixed(served)], None, remote):
        pass
