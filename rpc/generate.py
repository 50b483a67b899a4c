"""Generator of rpc/v1, and of the client's stubs, from proto/rpc/v1: `python -m rpc.generate
[OUT]`."""

import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CLIENT = "client/inhabit_client/v1"
#: Files of the client: of the policy service alone, which import one another there.
_OF_CLIENT = ("policy_pb2.py", "policy_pb2.pyi", "policy_pb2_grpc.py")
_HERE, _THERE = "from rpc.v1 import", "from inhabit_client.v1 import"


def generate(out: Path) -> None:
    """Write the stubs of all .proto files to `out`/rpc/v1, and those of the policy service to
    `out`/client/inhabit_client/v1; needs grpcio-tools."""
    _stubs(out)
    folder = out / CLIENT
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        _stubs(Path(made))
        for name in _OF_CLIENT:
            text = (Path(made) / "rpc" / "v1" / name).read_text()
            (folder / name).write_text(text.replace(_HERE, _THERE))


def _stubs(out: Path) -> None:
    from grpc_tools import protoc  # a development tool, not a dependency

    sources = sorted(str(path) for path in (ROOT / "proto").rglob("*.proto"))
    kinds = [f"--{kind}_out={out}" for kind in ("python", "pyi", "grpc_python")]
    if protoc.main(["protoc", f"-I{ROOT / 'proto'}", *kinds, *sources]) != 0:
        raise SystemExit(1)


if __name__ == "__main__":
    generate(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT)
