"""`inhabit synthesize`: every file read back by somebody else, and what a user gets wrong."""

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import imageio.v3 as imageio
import mujoco
import numpy as np
import pybvh
import pytest

from console.app import main
from console.commands import Synthesize
from console.recording import format as recording
from console.recording import video
from console.synthesis import files as motion_files
from console.synthesis import request as scene_request
from console.synthesis.motion import Motion, simulate
from examples import synthesize_bvh
from policy.checkpoints.served import Served
from tests.support.paths import ROOT
from tests.support.policy_cases import fixed, make, running
from tests.world.meshes.test_meshes import written
from world import tasks
from world.character import model as character
from world.furniture.catalogue import find
from world.motions import load

SIT = str(ROOT / "pretrained" / "sit")


def asked(*words: str) -> list[str]:
    return ["synthesize", SIT, "--object", "chair-test-000", *words]


def command(task: str, piece: str, **flags: object) -> Synthesize:
    return replace(Synthesize(Path(task), piece, ()), **flags)  # pyright: ignore


def made(served: Served, flags: Synthesize, seed: int | None = None) -> Motion:
    request, piece = scene_request.scene(flags, served.task, seed)
    return simulate(request, served, piece)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """What the committed policy does from right before a chair, in every kind of file but films."""
    folder = tmp_path_factory.mktemp("motion") / "new"
    kinds = [suffix for suffix in motion_files.WRITERS if suffix != ".mp4"]
    found = {suffix: folder / f"sits{suffix}" for suffix in kinds}
    words = ["--start", "0.6,0,0", "--seconds", "6", "--tries", "5", "--out"]
    assert main(asked(*words, *map(str, found.values()))) == 0
    return found


def bodies(take: recording.Take) -> np.ndarray:
    """Positions [T, 15, 3] m of the character's bodies: MuJoCo's own kinematics."""
    model = character.spec().compile()
    data = mujoco.MjData(model)
    found = []
    for qpos in take.qpos:
        data.qpos[:] = qpos[: character.NQ]
        mujoco.mj_kinematics(model, data)
        found.append(data.xpos[1:].copy())
    return np.stack(found)


def y_up_cm(positions: np.ndarray) -> np.ndarray:
    """In BVH's axes: ours are x forward, y left, z up."""
    x, y, z = np.moveaxis(positions, -1, 0)
    return 100.0 * np.stack((y, z, x), axis=-1)


def test_it_sits_and_says_so(files: dict[str, Path]) -> None:
    take = recording.read(files[".msgpack"]).takes[0]
    hip = np.array(find("chair-test-000").sit[0].point_m)
    pelvis = take.qpos[-1, :3]
    assert np.linalg.norm(pelvis[:2] - hip[:2]) < 0.25 and 0.0 < pelvis[2] - hip[2] < 0.3
    assert take.qpos[0, 2] - pelvis[2] > 0.3, "it stood at first"


def test_bvh_read_by_another_has_the_same_joints(files: dict[str, Path]) -> None:
    take = recording.read(files[".msgpack"]).takes[0]
    read = pybvh.read_bvh_file(files[".bvh"])
    assert read.world_up == "+y" and read.frame_count == len(take)
    assert read.fps == pytest.approx(30.0, abs=1e-4)
    assert list(read.joint_names) == list(character.BODIES)
    wanted = y_up_cm(bodies(take))
    assert np.abs(read.joint_positions() - wanted).max() < 0.1, "a millimetre"
    # no angle jumps where the motion does not
    assert np.abs(np.diff(read.joint_angles, axis=0)).max() < np.pi / 2


def test_bvh_has_the_form_that_animation_programs_expect(files: dict[str, Path]) -> None:
    lines = [line.strip() for line in files[".bvh"].read_text().splitlines()]
    assert lines[0] == "HIERARCHY" and lines[1] == "ROOT pelvis"
    channels = [line for line in lines if line.startswith("CHANNELS")]
    angles = "Zrotation Xrotation Yrotation"
    assert channels[0] == f"CHANNELS 6 Xposition Yposition Zposition {angles}"
    assert channels[1:] == [f"CHANNELS 3 {angles}"] * 14
    assert lines.count("End Site") == 5 and lines.count("{") == lines.count("}") == 20
    at = lines.index("MOTION")
    frames = int(lines[at + 1].removeprefix("Frames:"))
    assert lines[at + 2] == "Frame Time: 0.0333333"
    assert len(lines) == at + 3 + frames
    assert {len(line.split()) for line in lines[at + 3 :]} == {3 + 3 * 15}


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


def test_a_clip_is_read_as_it_was(files: dict[str, Path]) -> None:
    clip = load.read(files[".npz"])
    take = recording.read(files[".msgpack"]).takes[0]
    np.testing.assert_allclose(clip.qpos()[:, :3], take.qpos[:, :3], atol=1e-5)
    ball = character.BALL_QPOS[3]
    dots = (clip.qpos()[:, ball : ball + 4] * take.qpos[:, ball : ball + 4]).sum(1)
    np.testing.assert_allclose(np.abs(dots), 1.0, atol=1e-4)
    hinges = list(character.HINGE_QPOS)
    np.testing.assert_allclose(clip.qpos()[:, hinges], take.qpos[:, hinges], atol=1e-3)
    assert clip.fps == 30 and "research only" in clip.licence and "synthesised" in clip.source
    assert clip.seat is not None and clip.seat.to_frame == clip.frames
    np.testing.assert_allclose(clip.seat.point_m, find("chair-test-000").sit[0].point_m, atol=1e-5)
    assert (
        main(["motions", "play", str(files[".npz"]), "--html", str(files[".npz"]) + ".html"]) == 0
    )
    assert oct(files[".npz"].stat().st_mode)[-3:] == "644"


def test_full_states_go_on_as_they_went(files: dict[str, Path]) -> None:
    """A frame's state and the next one's targets are all that MuJoCo needs to make the next."""
    take = recording.read(files[".msgpack"]).takes[0]
    model = recording.model_of(take)
    data = mujoco.MjData(model)
    for frame in (0, 20, len(take) - 2):
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = take.qpos[frame], take.qvel[frame]
        data.mocap_pos[0], data.mocap_quat[0] = take.mocap_pos[frame], take.mocap_quat[frame]
        data.ctrl[:] = take.ctrl[frame + 1]
        for _ in range(character.SUBSTEPS):
            mujoco.mj_step(model, data)
        np.testing.assert_allclose(data.qpos, take.qpos[frame + 1], atol=2e-4)


def test_the_page_needs_nothing_but_itself(files: dict[str, Path]) -> None:
    text = files[".html"].read_text()
    assert not re.search(r"https?://|<link|\bsrc=|@import|url\(", text)
    held = re.search(r'id="takes">(.*?)</script>', text)
    assert held is not None
    (shown,) = json.loads(held[1].replace("<\\/", "</"))
    take = recording.read(files[".msgpack"]).takes[0]
    poses = np.frombuffer(base64.b64decode(shown["poses"]), "<i2")
    poses = poses.reshape(len(take), shown["bodies"], 7)
    np.testing.assert_allclose(poses[:, shown["root"], :3] / 1000, take.qpos[:, :3], atol=6e-4)
    assert shown["frames"] == len(take) and not shown["fell"]
    assert "none: the checkpoint has no discriminator" in text and "and stays" in text
    assert text.count('class="chart"') == 3


@pytest.mark.skipif(video.choose_gl() is None, reason="nothing draws offscreen here")
def test_a_film_has_every_frame_and_its_balls(tmp_path: Path) -> None:
    flags = command("sit", "low-stool-test-000", seconds=0.5, perturb="projectiles", seed=1)
    motion = made(make(), replace(flags, to_the_end=True))
    film, states = tmp_path / "a.mp4", tmp_path / "a.msgpack"
    motion_files.write(film, motion)
    motion_files.write(states, motion)
    images = imageio.imread(film)
    assert images.shape == (16, 480, 640, 3)
    take = recording.read(states).takes[0]
    there = np.isfinite(take.balls[-1, :, 0])
    assert motion.summary.balls_thrown == 15 and there.any()
    look = video.Look(width=160, height=120, distance_m=8.0)

    def red(shown: recording.Take) -> int:
        (image,) = video.draw(shown, look, [len(take) - 1], 1.0)
        r, g, b = np.moveaxis(image.astype(int), -1, 0)
        return int(((r > 90) & (r > 2 * g) & (r > 2 * b)).sum())

    assert red(take) > 10 and red(replace(take, balls=np.full_like(take.balls, np.nan))) == 0


def test_furniture_that_moves_moves_in_the_recording(tmp_path: Path) -> None:
    flags = command("sit", "chair-test-003", seconds=1.0, perturb="moved", seed=5, start="0.5,0,0")
    motion = made(make(), replace(flags, to_the_end=True, at="0.1,0.2,30"))
    take = motion.track.take
    np.testing.assert_allclose(take.mocap_pos[0], [0.1, 0.2, 0.0], atol=1e-6)
    yaw = 2 * np.arctan2(take.mocap_quat[0, 3], take.mocap_quat[0, 0])
    assert np.rad2deg(yaw) == pytest.approx(30.0)
    shift = np.linalg.norm(motion.places[-1].point[0, :2] - motion.places[0].point[0, :2])
    assert motion.summary.displaced and 0.5 - 1e-3 <= shift <= 1.5 + 1e-3


def test_lying_has_a_bed_to_either_side() -> None:
    served = make(1, "lie", "lie")
    starts = [made(served, command("lie", "bed-test-002", seconds=0.1, place=i)) for i in (0, 1)]
    facings = [motion.places[0].facing[0].numpy() for motion in starts]
    np.testing.assert_allclose(facings[0], -facings[1], atol=1e-5)
    # frames of success, as a policy that lies there would have them
    good = starts[0]
    for frame in good.frames[1:]:
        frame.success = True
    bed = good.clip().bed
    lie = find("bed-test-002").lie
    assert bed is not None and lie is not None and (bed.from_frame, bed.to_frame) == (1, 4)
    np.testing.assert_allclose(bed.hip_m, lie.hip_m, atol=1e-5)
    np.testing.assert_allclose(bed.head_m[:2], lie.head_m[:2], atol=1e-5)


def test_a_box_is_carried_along_in_every_file(tmp_path: Path) -> None:
    served = make(2, "carry", "carry")
    flags = command("carry", "box", seconds=0.3, scale=1.2, to="2,1,0.7", at="0.5,0,90")
    motion = made(served, replace(flags, box_kg=2.5, to_the_end=True))
    model = motion.track.model
    assert model.body("box").mass[0] == pytest.approx(2.5)
    for suffix in (".npz", ".bvh", ".html", ".msgpack"):
        motion_files.write(tmp_path / f"a{suffix}", motion)
    clip = load.read(tmp_path / "a.npz")
    assert clip.box is not None and not clip.box.held.any() and clip.seat is None
    np.testing.assert_allclose(clip.box.size_m, 1.2 * np.array([0.35, 0.5, 0.3]), rtol=1e-6)
    np.testing.assert_allclose(clip.box.pose[0, :3], [0.5, 0.0, 0.6 + 0.18], atol=1e-5)
    half = np.sqrt(0.5)
    np.testing.assert_allclose(np.abs(clip.box.pose[0, 3:]), [half, 0, 0, half], atol=1e-5)
    take = recording.read(tmp_path / "a.msgpack").takes[0]
    np.testing.assert_allclose(take.stand, [2.0, 1.0, 0.7], atol=1e-5)
    assert take.qpos.shape == (10, 50)
    error = np.linalg.norm(np.array([2.0, 1.0, 0.88]) - [0.5, 0.0, 0.78])
    assert motion.frames[0].error_m == pytest.approx(error, abs=1e-5)


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


WRONG = [
    ("--object chiar-test-000 --out a.npz", "nearest names are chair-test-000, "),
    ("--object none.glb --out a.npz", "none.glb"),
    ("--object high-stool-test-000 --scale 99 --out a.npz", "--scale 99: must be 0.2 to 5"),
    ("--object table-test-000 --out a.npz", "has no place to sit"),
    ("--object chair-test-000 --place 1 --out a.npz", "--place 1: chair-test-000 has 1"),
    ("--object chair-test-000 --start 1,2 --out a.npz", "--start 1,2: give X,Y,YAW"),
    ("--object chair-test-000 --start a,b,c --out a.npz", "--start a,b,c: give X,Y,YAW"),
    ("--object chair-test-000 --start 1,inf,2 --out a.npz", "--start 1,inf,2: each number"),
    ("--object chair-test-000 --seconds 0 --out a.npz", "--seconds 0: must be 0.0333333 to 600"),
    ("--object chair-test-000 --tries 0 --out a.npz", "--tries 0: must be 1 to"),
    ("--object chair-test-000 --seed -1 --out a.npz", "--seed -1: must be 0 to"),
    ("--object chair-test-000 --to 1,2,0.5 --out a.npz", "--to and --box-kg are of a box"),
    ("--object chair-test-000 --out a.fbx", "'.fbx'; choose .npz, .bvh, .html, .mp4, .msgpack"),
    ("--object chair-test-000 --out a", "unknown kind of file ''"),
    ("--object chair-test-000 --out a.bvh a.bvh", "names one file twice"),
    ("--object chair-test-000 --out there.bvh", "there.bvh exists: name another file, or add"),
    ("--object chair-test-000 --out there.bvh/a.bvh", "there.bvh is no folder"),
    ("--object chair-test-000", "--out"),
    ("--out a.npz", "--object"),
    ("--object chair-test-000 --perturb rain --out a.npz", "('none', 'projectiles', 'moved')"),
]


@pytest.mark.parametrize(("words", "named"), WRONG, ids=[words for words, _ in WRONG])
def test_one_line_names_what_is_wrong(
    words: str,
    named: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.bvh").write_text("mine")
    assert main(["synthesize", SIT, *words.split()]) in (1, 2)
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and named in said
    assert (tmp_path / "there.bvh").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["there.bvh"], "nothing is left"


def test_what_carry_needs_is_named() -> None:
    carry = tasks.make("carry")

    def said(**flags: object) -> str:
        with pytest.raises(Exception, match="--") as caught:
            scene_request.scene(replace(command("carry", "box"), **flags), carry, None)  # pyright: ignore
        return str(caught.value)

    assert "--to X,Y,HEIGHT: say where" in said()
    assert "give --object box" in said(object="chair-test-000")
    assert "--to's HEIGHT 9: choose" in said(to="1,2,9")
    assert "--box-kg 500: choose" in said(to="1,2,0.5", box_kg=500.0)
    assert "--scale 9: choose 0.167 to 4" in said(to="1,2,0.5", scale=9.0)
