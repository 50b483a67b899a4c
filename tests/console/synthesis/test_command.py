"""`inhabit synthesize`: every file read back by somebody else, and what a user gets wrong."""

from pathlib import Path

import mujoco
import numpy as np
import pybvh
import pytest

from console.app import main
from console.recording import format as recording
from console.synthesis import files as motion_files
from examples import synthesize_bvh
from tests.support.console.syntheses import asked, command, made
from tests.support.policy_cases import fixed, make, running
from tests.support.world.meshes import written
from world.furniture.catalogue import find


def test_it_sits_and_reports_success(files: dict[str, Path]) -> None:
    take = recording.read(files[".msgpack"]).takes[0]
    hip = np.array(find("chair-test-000").sit[0].point_m)
    pelvis = take.qpos[-1, :3]
    assert np.linalg.norm(pelvis[:2] - hip[:2]) < 0.25 and 0.0 < pelvis[2] - hip[2] < 0.3
    assert take.qpos[0, 2] - pelvis[2] > 0.3, "it stood at first"


def test_the_example_client_writes_the_same_motion(tmp_path: Path) -> None:
    theirs, ours = tmp_path / "theirs.bvh", tmp_path / "ours.bvh"
    with running([fixed(make())]) as server:
        count = synthesize_bvh.write(server.server.address, str(theirs), seconds=0.4)
    motion_files.write(ours, made(make(), command("sit", "chair-test-000", seconds=0.4)))
    first, second = (pybvh.read_bvh_file(path) for path in (theirs, ours))
    assert first.frame_count == second.frame_count == count
    for name in first.joint_names:
        pair = [read.joint_positions()[:, read.joint_index[name]] for read in (first, second)]
        # an untrained policy falls, and a fall multiplies the last digits
        np.testing.assert_allclose(pair[0][:8], pair[1][:8], atol=0.1)


def test_a_mesh_and_an_imported_piece_are_one_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    mesh = written(tmp_path, ".obj")
    assert main(["objects", "import", str(mesh), "--out", str(tmp_path / "objects")]) == 0
    imported = tmp_path / "objects" / "chair.piece.json"
    motions = [made(make(), command("sit", str(word), seconds=0.2)) for word in (mesh, imported)]
    ours, theirs = (motion.track.take for motion in motions)
    np.testing.assert_array_equal(ours.qpos, theirs.qpos)
    hulls = motions[0].track.model.geom_type == mujoco.mjtGeom.mjGEOM_MESH
    assert hulls.sum() >= 4, "it stands there as its hulls"


def test_further_seeds_are_tried_until_the_last(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a.msgpack"
    words = ["--seconds", "0.1", "--tries", "3", "--seed", "7", "--out", str(out)]
    assert main(asked(*words)) == 0
    said = capsys.readouterr().out
    assert [f"try {k}, seed {6 + k}:" in said for k in (1, 2, 3, 4)] == [True, True, True, False]
    last = recording.read(out).takes[0].qpos
    assert main(asked("--seconds", "0.1", "--seed", "9", "--out", str(out), "--overwrite")) == 0
    np.testing.assert_array_equal(last, recording.read(out).takes[0].qpos)
