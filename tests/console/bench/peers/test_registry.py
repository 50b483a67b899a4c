"""The peers: pinned as in the extra, each with an adapter."""

import importlib
import tomllib

import pytest

from console.bench.peers.registry import NAMES, PEERS, adapter, by_name
from tests.support.paths import ROOT

EXTRA = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]


def test_the_extra_pins_what_is_measured() -> None:
    assert set(EXTRA["peers"]) == {f"{peer.requirement}=={peer.version}" for peer in PEERS}


@pytest.mark.parametrize("name", NAMES)
def test_an_adapter_can_be_imported_without_its_library(name: str) -> None:
    """Worker processes of the scenes import it again, and need no library."""
    module = importlib.import_module(f"console.bench.peers.{name}")
    assert adapter(name).samefile(str(module.__file__)) and by_name(name).name == name
    assert callable(module.open_peer)
