"""Generator of rpc/v1 from proto/rpc/v1: `python -m rpc.generate [OUT]`."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def generate(out: Path) -> None:
    """Write the stubs of all .proto files to `out`/rpc/v1; needs grpcio-tools."""
    from grpc_tools import protoc  # a development tool, not a dependency

    sources = sorted(str(path) for path in (ROOT / "proto").rglob("*.proto"))
    kinds = [f"--{kind}_out={out}" for kind in ("python", "pyi", "grpc_python")]
    if protoc.main(["protoc", f"-I{ROOT / 'proto'}", *kinds, *sources]) != 0:
        raise SystemExit(1)


if __name__ == "__main__":
    generate(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT)
