"""The example clients against a running service: the service's own motion, BVH read back."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from examples import drive_mujoco, synthesize_bvh
from rpc.v1 import policy_pb2 as pb
from tests.support.paths import ROOT
from tests.support.policy_cases import Running, fixed, make, running, stub

EXAMPLES = ROOT / "examples"


@pytest.fixture(scope="module")
def server() -> Iterator[Running]:
    with running([fixed(make())]) as found:
        yield found


def test_the_examples_need_none_of_our_code() -> None:
    for file, more in (("drive_mujoco.py", {"mujoco"}), ("synthesize_bvh.py", set())):
        text = (EXAMPLES / file).read_text()
        found = {
            (node.module if isinstance(node, ast.ImportFrom) else node.names[0].name) or ""
            for node in ast.walk(ast.parse(text))
            if isinstance(node, ast.Import | ast.ImportFrom)
        }
        ours = {name for name in found if name.split(".")[0] not in sys.stdlib_module_names}
        assert ours <= {"grpc", "numpy", "rpc.v1"} | more, ours
    assert len((EXAMPLES / "drive_mujoco.py").read_text().splitlines()) <= 66


def test_a_mujoco_of_ones_own_moves_as_the_services_does(server: Running) -> None:
    ours = drive_mujoco.drive(server.server.address, 0.5)
    request = pb.SynthesizeRequest(task="sit", furniture=drive_mujoco.CHAIR, seconds=0.5)
    request.to_the_end = True
    for centre, half in drive_mujoco.BOXES:
        request.furniture.custom.boxes.add(centre=centre, half=half)
    # the model's own rest pose, as the example starts
    import mujoco

    with stub(server) as client:
        model = mujoco.MjModel.from_xml_string(client.Describe(pb.DescribeRequest()).mjcf)
        data = mujoco.MjData(model)
        request.start.pose.CopyFrom(drive_mujoco.pose(data))
        frames = [part.frame for part in client.Synthesize(request) if part.HasField("frame")]
    theirs = np.array([frame.root_position for frame in frames[1:]])
    # an untrained policy falls, and a fall multiplies the last digits of the solver
    np.testing.assert_allclose(ours[:6], theirs[:6], atol=1e-3)
    assert np.abs(ours - ours[0]).max() > 0.02, "it moves"


def test_bvh_read_back_gives_the_same_bodies(server: Running, tmp_path: Path) -> None:
    out = tmp_path / "motion.bvh"
    count = synthesize_bvh.write(server.server.address, str(out), seconds=0.3)
    request = pb.SynthesizeRequest(
        task="sit", furniture=pb.Furniture(piece="chair-test-000"), seconds=0.3, bodies=True
    )
    request.start.standing.CopyFrom(pb.Stance(x=3, yaw_rad=np.pi))
    with stub(server) as client:
        header, *parts = client.Synthesize(request)
    frames = [part.frame for part in parts if part.HasField("frame")]
    assert count == len(frames)
    names, positions = read(out)
    bodies = [body.name for body in header.header.bodies]
    for name in ("pelvis", "head", "right_foot", "left_lower_arm"):
        ours = positions[:, names.index(name)]
        theirs = np.array([f.body_position for f in frames]).reshape(count, 15, 3)
        x, y, z = np.moveaxis(theirs[:, bodies.index(name)], 1, 0)
        np.testing.assert_allclose(ours / 100, np.stack((y, z, x), 1), atol=1e-3)


def read(file: Path) -> tuple[list[str], np.ndarray]:
    """Joint names and positions [frames, joints, 3] of a BVH, read without any of our code."""
    words = iter(file.read_text().split("MOTION")[0].split())
    names: list[str] = []
    parents: list[int] = []
    offsets: list[list[float]] = []
    stack: list[int] = []
    ending = False
    for word in words:
        if word in ("ROOT", "JOINT"):
            parents.append(stack[-1] if stack else -1)
            names.append(next(words))
        elif word == "End":
            ending = True
        elif word == "{":
            stack.append(-2 if ending else len(names) - 1)
        elif word == "}":
            ending = False if stack.pop() == -2 else ending
        elif word == "OFFSET" and not ending:
            offsets.append([float(next(words)) for _ in range(3)])
    rows = file.read_text().split("Frame Time:")[1].splitlines()[1:]
    numbers = np.array([[float(x) for x in row.split()] for row in rows if row])
    positions = np.zeros((len(numbers), len(names), 3))
    for k, row in enumerate(numbers):
        turned: list[Rotation] = []
        for joint, parent in enumerate(parents):
            own = Rotation.from_euler("ZXY", row[3 + 3 * joint : 6 + 3 * joint], degrees=True)
            above = Rotation.identity() if parent < 0 else turned[parent]
            turned.append(above * own)
            here = row[:3] if parent < 0 else positions[k, parent] + above.apply(offsets[joint])
            positions[k, joint] = here
    return names, positions


@pytest.mark.parametrize(
    "script", ["examples/drive_mujoco.py", "examples/synthesize_bvh.py", "deploy/submit.py"]
)
def test_scripts_explain_themselves(script: str, tmp_path: Path) -> None:
    """From any folder, without arguments that they need and without a service."""
    words = [sys.executable, str(ROOT / script), "--help"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and not done.stderr and "usage: " in done.stdout


def test_a_service_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    words = [sys.executable, str(EXAMPLES / "synthesize_bvh.py"), "127.0.0.1:9", "x.bvh"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert done.stderr.startswith("synthesize_bvh.py: failed to connect")
