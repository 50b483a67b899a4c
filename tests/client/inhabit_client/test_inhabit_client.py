"""The client as a package: small, and without what the project needs."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import inhabit_client
from tests.support.paths import ROOT
from tests.support.policy_cases import fixed, make, running

#: A finder that refuses all but what the client may need, and a motion by the client.
ALONE = """
import sys
REFUSED = ("torch", "mujoco", "ray", "scipy", "world", "rpc", "policy", "console", "actors",
           "learner", "discriminator", "google.rpc", "grpc_reflection", "msgpack")
class Refusing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in REFUSED or name in REFUSED:
            raise ImportError(f"refused: {name}")
sys.meta_path.insert(0, Refusing())
sys.path.insert(0, sys.argv[1])
try:
    import torch
except ImportError as error:
    assert "refused" in str(error)
else:
    raise SystemExit("nothing is refused")
import inhabit_client as inhabit
with inhabit.connect(sys.argv[2]) as service:
    motion = service.synthesize("sit", inhabit.furniture("chair-test-000"), seconds=0.2)
    print(len(motion.frames), motion.bodies()[0].shape)
print(*sorted(name for name in sys.modules if name.split(".")[0] in REFUSED))
"""


def test_it_runs_where_nothing_else_is(tmp_path: Path) -> None:
    with running([fixed(make())]) as server:
        words = [sys.executable, "-I", "-c", ALONE, ROOT / "client", server.server.address]
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "7 (7, 15, 3)\n\n"


def test_everything_named_is_there() -> None:
    assert all(hasattr(inhabit_client, name) for name in inhabit_client.__all__)
    assert (ROOT / "client/inhabit_client/py.typed").exists()


def test_its_wheel_is_small_and_names_its_needs(tmp_path: Path) -> None:
    pytest.importorskip("setuptools")
    import shutil

    source = tmp_path / "client"
    shutil.copytree(ROOT / "client", source, ignore=shutil.ignore_patterns("build", "*.egg-info"))
    words = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "--quiet",
             "--disable-pip-version-check", "--wheel-dir", tmp_path, source]  # fmt: skip
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    (wheel,) = tmp_path.glob("inhabit_client-*.whl")
    assert wheel.stat().st_size <= 200_000
    with zipfile.ZipFile(wheel) as file:
        names = set(file.namelist())
        (about,) = [n for n in names if n.endswith("METADATA")]
        needs = [line.partition(": ")[2] for line in file.read(about).decode().splitlines()
                 if line.startswith("Requires-Dist")]  # fmt: skip
    assert {need.split(">")[0].split("<")[0] for need in needs} == {"grpcio", "protobuf", "numpy"}
    assert {"inhabit_client/py.typed", "inhabit_client/v1/policy_pb2.pyi"} <= names
    modules = {p.relative_to(ROOT / "client").as_posix() for p in (ROOT / "client").rglob("*.py")}
    assert {name for name in names if name.endswith(".py")} == modules
