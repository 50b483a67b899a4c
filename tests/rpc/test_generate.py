"""The committed stubs are those of the proto files."""

from pathlib import Path

import pytest

from rpc.generate import CLIENT, ROOT, generate


def test_committed_stubs_are_those_of_the_proto(tmp_path: Path) -> None:
    pytest.importorskip("grpc_tools")
    generate(tmp_path)
    made = {p.name: p.read_text() for p in (tmp_path / "rpc/v1").iterdir()}
    kept = {p.name: p.read_text() for p in (ROOT / "rpc/v1").glob("*_pb2*.py*")}
    assert made == kept, "run `make proto`"


def test_the_clients_stubs_are_those_of_the_proto(tmp_path: Path) -> None:
    pytest.importorskip("grpc_tools")
    generate(tmp_path)
    made = {p.name: p.read_text() for p in (tmp_path / CLIENT).iterdir()}
    kept = {p.name: p.read_text() for p in (ROOT / CLIENT).glob("*_pb2*.py*")}
    assert made == kept, "run `make proto`"
    assert len(made) == 3 and not any("from rpc" in text for text in made.values())
