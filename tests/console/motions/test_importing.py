"""`inhabit motions import` and `check` as a user meets them, bad input above all."""

import json
import os
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from console.app import main
from console.motions.importing import distinct
from tests.support import foreign_motions
from world.errors import ClipError
from world.motions import clip_file, load
from world.motions.clip import Clip
from world.motions.synthetic import library


@pytest.fixture(scope="module")
def walking() -> Clip:
    return library.walking(np.random.default_rng(0), 1.2).part(30, 54)


@pytest.fixture(scope="module")
def bvh(tmp_path_factory: pytest.TempPathFactory, walking: Clip) -> Path:
    return foreign_motions.bvh_of(tmp_path_factory.mktemp("bvh") / "walk.bvh", walking)


def refused(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], *flags: str, code: int = 1
) -> str:
    """The one line with which a file is refused; nothing of it may be left."""
    out = tmp_path / "out"
    assert main(["motions", "import", str(path), "--out", str(out), *flags]) == code
    captured = capsys.readouterr()
    lines = captured.err.strip().splitlines()
    assert len(lines) == 1, captured.err
    assert lines[0].startswith("inhabit: ")
    assert "Traceback" not in captured.err
    assert not out.exists() or not list(out.iterdir())
    return lines[0]


def test_import_writes_clips_that_training_reads(
    tmp_path: Path, bvh: Path, walking: Clip, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "clips"
    assert main(["motions", "import", str(bvh), "--out", str(out)]) == 0
    assert "walk: 0.8 s, hands and feet" in capsys.readouterr().out
    clip = load.read(out / "walk.npz")
    assert (clip.frames, clip.fps) == (walking.frames, 30)
    assert clip.ghost is not None
    assert clip.ghost.names[: len(foreign_motions.NAMES)] != ()
    assert main(["motions", "check", str(out), "--json"]) == 0
    (report,) = json.loads(capsys.readouterr().out)
    assert report["clip"] == "walk"
    assert report["key_body_error_m"] < 0.02
    assert report["penetration_m"] < 0.005
    assert report["foot_skate_after_m_s"] < report["foot_skate_before_m_s"] + 0.01
    assert report["past_limits"] == 0
    assert report["verdict"] == "good"
    # what is there is not written over unasked
    assert main(["motions", "import", str(bvh), "--out", str(out)]) == 2
    assert "--replace" in capsys.readouterr().err
    assert not list(out.glob(".*"))


def test_motions_of_one_name_get_different_names() -> None:
    paths = [Path(p) for p in ("/m/a/walk.bvh", "/m/b/walk.bvh", "/m/a/turn.bvh", "/m/a/turn.amc")]
    assert distinct(paths) == ["a_walk", "b_walk", "a_turn_bvh", "a_turn_amc"]
    with pytest.raises(ClipError, match="two motions have the name a_walk_bvh"):
        distinct([Path("/m/a/walk.bvh"), Path("/n/a/walk.bvh")])


def test_a_bad_file_among_good_ones_costs_itself_alone(
    tmp_path: Path, bvh: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    lines = bvh.read_text().splitlines()
    short = [line if not line.startswith("Frames:") else "Frames: 4" for line in lines]
    (folder / "good.bvh").write_text("\n".join(short[: len(lines) - 20]) + "\n")
    (folder / "bad.bvh").write_text("\n".join(lines[:-5]))
    (folder / "licence.txt").write_text("free")
    out = tmp_path / "out"
    assert main(["motions", "import", str(folder), "--out", str(out)]) == 1
    captured = capsys.readouterr()
    assert "bad.bvh" in captured.err
    assert [p.name for p in out.iterdir()] == ["good.npz"]
    assert "1 clip, " in captured.out


def test_truncated_files(
    tmp_path: Path, bvh: Path, walking: Clip, capsys: pytest.CaptureFixture[str]
) -> None:
    text = bvh.read_text()
    cut = tmp_path / "cut.bvh"
    for share in (0.1, 0.5, 0.95):
        cut.write_text(text[: int(share * len(text))])
        assert "not a readable BVH" in refused(cut, tmp_path, capsys)
    cut.write_bytes(b"")
    assert "not a readable BVH" in refused(cut, tmp_path, capsys)
    whole = foreign_motions.deepmimic_of(tmp_path / "w.txt", walking).read_text()
    (tmp_path / "cut.txt").write_text(whole[: len(whole) // 2])
    assert "not a readable DeepMimic" in refused(tmp_path / "cut.txt", tmp_path, capsys)
    clip_file.write(tmp_path / "w.npz", walking)
    data = (tmp_path / "w.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(data[: len(data) // 2])
    assert "not a readable .npz" in refused(tmp_path / "cut.npz", tmp_path, capsys)
    data = pickle.dumps({"frames": np.zeros((50, 34)), "fps": 30})
    (tmp_path / "cut.pkl").write_bytes(data[: len(data) // 2])
    assert "not a readable pickle" in refused(tmp_path / "cut.pkl", tmp_path, capsys)


def test_a_motion_without_its_skeleton(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "09_01.amc").write_text(":DEGREES\n1\nroot 0 0 0 0 0 0\n")
    assert "no skeleton 09.asf beside it" in refused(tmp_path / "09_01.amc", tmp_path, capsys)


def test_cut_short_acclaim(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from tests.support.world.motion_files import AMC, ASF

    (tmp_path / "07.asf").write_text(ASF)
    (tmp_path / "07_01.amc").write_text(AMC[:-6])
    line = refused(tmp_path / "07_01.amc", tmp_path, capsys)
    assert "frame 2 has" in line
    assert "cut short" in line


def test_values_that_are_no_numbers(
    tmp_path: Path, bvh: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = bvh.read_text().splitlines()
    words = lines[-3].split()
    words[4] = "nan"
    lines[-3] = " ".join(words)
    path = tmp_path / "nan.bvh"
    path.write_text("\n".join(lines) + "\n")
    assert "non-finite values" in refused(path, tmp_path, capsys)


def test_unknown_joint_names_and_the_map_that_names_them(
    tmp_path: Path, bvh: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "odd.bvh"
    path.write_text(bvh.read_text().replace("LeftLeg", "LeftLegg").replace("Head", "Kopf"))
    line = refused(path, tmp_path, capsys)
    assert "left_knee (nearest: LeftLegg)" in line
    assert "RightForeArm" in line
    assert "--map" in line
    names = tmp_path / "map.json"
    names.write_text(json.dumps({"left_knee": "LeftLegg", "head": "Kopf"}))
    out = tmp_path / "clips"
    assert main(["motions", "import", str(path), "--out", str(out), "--map", str(names)]) == 0
    capsys.readouterr()
    names.write_text(json.dumps({"left_knee": "Nobody", "head": "Kopf"}))
    assert "'Nobody' as left_knee" in refused(path, tmp_path, capsys, "--map", str(names))
    names.write_text(json.dumps({"left_nee": "LeftLegg"}))
    line = refused(path, tmp_path, capsys, "--map", str(names), code=2)
    assert "unknown part 'left_nee'" in line
    assert "left_knee" in line


@pytest.mark.parametrize("frames", [0, 1])
def test_too_few_frames(
    tmp_path: Path, bvh: Path, capsys: pytest.CaptureFixture[str], frames: int
) -> None:
    lines = bvh.read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("Frames:"))
    lines[at] = f"Frames: {frames}"
    path = tmp_path / "short.bvh"
    path.write_text("\n".join(lines[: at + 2 + frames]) + "\n")
    assert "rame" in refused(path, tmp_path, capsys)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("no JSON", "not a readable map file"),
        ("[1]", "a map file is an object such as"),
        ('{"left_kne": "x"}', "unknown part 'left_kne': choose from head, right_hip"),
        ('{"fps": -3}', "fps is a rate from 1 to 1000, is -3"),
    ],
)
def test_a_wrong_map_file_is_a_wrong_argument(
    content: str, said: str, tmp_path: Path, bvh: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names, out = tmp_path / "map.json", tmp_path / "out"
    names.write_text(content)
    assert main(["motions", "import", str(bvh), "--out", str(out), "--map", str(names)]) == 2
    line = capsys.readouterr().err
    assert f"--map {names}: {said}" in line and line.count("\n") == 1 and not out.exists()


def test_absurd_units(tmp_path: Path, bvh: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = tmp_path / "map.json"
    names.write_text(json.dumps({"unit_m": 1.0}))
    line = refused(bvh, tmp_path, capsys, "--map", str(names))
    assert "absurd units" in line
    assert "unit_m" in line


class _Bomb:
    """An object whose unpickling runs a command."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.system, (f"touch {self._path}",)


def test_malicious_pickles_run_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flag = tmp_path / "ran"
    (tmp_path / "bomb.pkl").write_bytes(pickle.dumps({"frames": _Bomb(flag), "fps": 30}))
    line = refused(tmp_path / "bomb.pkl", tmp_path, capsys)
    assert "refused: the pickle asks for" in line
    assert "system" in line
    np.save(tmp_path / "bomb.npy", {"rotation": _Bomb(flag)})  # pyright: ignore
    assert "refused: the pickle asks for" in refused(tmp_path / "bomb.npy", tmp_path, capsys)
    np.savez(tmp_path / "bomb.npz", trans=np.array(_Bomb(flag)), poses=np.zeros((4, 156)))
    refused(tmp_path / "bomb.npz", tmp_path, capsys)
    assert not flag.exists()


def test_what_is_no_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = tmp_path / "a.fbx"
    other.write_text("x")
    assert ".bvh" in refused(other, tmp_path, capsys)
    assert "no such file" in refused(tmp_path / "none", tmp_path, capsys, code=2)
    np.savez(tmp_path / "b.npz", weights=np.zeros(3))
    line = refused(tmp_path / "b.npz", tmp_path, capsys)
    assert "holds weights" in line
    assert "mocap" not in line.split("expected")[0]
    (tmp_path / "c.pkl").write_bytes(pickle.dumps([1, 2]))
    assert "holds a list" in refused(tmp_path / "c.pkl", tmp_path, capsys)
    np.save(tmp_path / "d.npy", np.zeros(3))
    assert "not a motion" in refused(tmp_path / "d.npy", tmp_path, capsys)
    line = refused(other, tmp_path, capsys, "--format", "fbx", code=2)
    assert "choose one of acclaim, amass, bvh" in line


def test_flags_state_what_files_do_not(
    tmp_path: Path, bvh: Path, walking: Clip, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    at_60 = tmp_path / "map.json"
    at_60.write_text(json.dumps({"fps": 60}))

    def frames(*flags: str) -> int:
        assert main(["motions", "import", str(bvh), "--out", str(out), "--replace", *flags]) == 0
        return load.read(out / "walk.npz").frames

    assert frames() == walking.frames
    assert frames("--fps", "15") == 2 * walking.frames - 1
    assert frames("--map", str(at_60)) == walking.frames // 2
    # a flag overrides the map
    assert frames("--map", str(at_60), "--fps", "30") == walking.frames
    assert frames("--unit", "cm", "--up", "y") == walking.frames
    capsys.readouterr()
    line = refused(bvh, tmp_path / "other", capsys, "--unit", "m")
    assert "absurd units" in line and "--unit" in line and str(bvh) in line
    assert main(["motions", "import", str(bvh), "--out", str(out), "--fps", "0"]) == 2
    assert "--fps 0: must be 1 to 1000" in capsys.readouterr().err
    for flag, wrong in (("--unit", "furlong"), ("--up", "w")):
        assert main(["motions", "import", str(bvh), "--out", str(out), flag, wrong]) == 2
        assert flag in capsys.readouterr().err


def test_the_unit_of_a_body_models_travel(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    poses, trans = np.zeros((60, 66)), np.zeros((60, 3))
    poses[:, 0] = np.pi / 2  # y up in the model, z up in the file
    trans[:, 0], trans[:, 2] = 100 * np.linspace(0, 1, 60), 100 * 1.15
    np.savez(tmp_path / "slide.npz", poses=poses, trans=trans, mocap_framerate=30.0)
    out = tmp_path / "out"
    flags = ["motions", "import", str(tmp_path / "slide.npz"), "--out", str(out), "--unit", "cm"]
    assert main(flags) == 0
    clip = load.read(out / "slide.npz")
    travel = np.linalg.norm(np.ptp(clip.root_position_m[:, :2], axis=0))
    # of the mean SMPL body, as large as the character by its legs (0.39 + 0.42 m along the bones)
    legs = np.linalg.norm((43, -385, 2)) + np.linalg.norm((-17, -423, -36))
    assert travel == pytest.approx(1e3 * (0.421546 + 0.40987) / legs, rel=0.01)


def test_an_implausible_motion_is_called_that(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    walk = library.walking(np.random.default_rng(0), 1.2).part(60, 180)
    path = foreign_motions.bvh_of(tmp_path / "walk.bvh", walk)
    out = str(tmp_path / "out")
    assert main(["motions", "import", str(path), "--out", out, "--fps", "120"]) == 0
    line = capsys.readouterr().out
    assert "; 1 implausible" in line and "is it at 30 fps? (--fps 30)" in line
    assert main(["motions", "check", str(path), "--fps", "120", "--json"]) == 0
    (report,) = json.loads(capsys.readouterr().out)
    assert report["verdict"] == "implausible" and "--fps 30" in report["implausible"]
    assert main(["motions", "check", str(path)]) == 0
    assert "1 good, 0 fair, 0 poor" in capsys.readouterr().out


def test_the_rate_that_a_file_states_is_not_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    walk = library.walking(np.random.default_rng(0), 1.2).part(60, 180)
    path = foreign_motions.bvh_of(tmp_path / "walk.bvh", replace(walk, fps=120))
    for words in (["import", str(path), "--out", str(tmp_path / "out")], ["check", str(path)]):
        assert main(["motions", *words]) == 0
        shown = " ".join(capsys.readouterr().out.split())
        assert "at the 120 fps that the file states (--fps 30 overrides)" in shown
        assert "is it at" not in shown


def test_companions_of_a_folder_are_left_out_and_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    poses, trans = np.zeros((30, 156)), np.zeros((30, 3))
    poses[:, 0], trans[:, 2] = np.pi / 2, 1.15
    folder = tmp_path / "S1"
    folder.mkdir()
    np.savez(folder / "stand_stageii.npz", poses=poses, trans=trans, mocap_frame_rate=30.0)
    np.savez(folder / "shape.npz", betas=np.zeros(16), gender="female")
    out = tmp_path / "out"
    assert main(["motions", "import", str(folder), "--out", str(out)]) == 0
    assert "left out, since they hold no motion: shape.npz" in capsys.readouterr().out
    assert [path.name for path in out.iterdir()] == ["stand_stageii.npz"]
    # named itself, it is refused
    assert "holds betas, gender" in refused(folder / "shape.npz", tmp_path / "other", capsys)


def test_names_with_brackets_are_shown_whole(
    tmp_path: Path, bvh: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "walk [red].bvh"
    path.write_bytes(bvh.read_bytes())
    assert main(["motions", "import", str(path), "--out", str(tmp_path / "out")]) == 0
    assert main(["motions", "list", str(tmp_path / "out")]) == 0
    assert main(["motions", "check", str(path)]) == 0
    assert capsys.readouterr().out.count("walk [red]") == 3


def test_refusals_name_the_file_as_it_was_given(
    tmp_path: Path, bvh: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = bvh.read_text()
    bad = {
        "pointer.npz": "version https://git-lfs.github.com/spec/v1\n",
        "page.bvh": "<!DOCTYPE html><html></html>",
        "joint.bvh": text.replace("JOINT Head", "JOINT Kopf"),
        "cut.bvh": text[: len(text) // 2],
        "point.bvh": "\n".join(
            "OFFSET 0 0 0" if "OFFSET" in line else line for line in text.splitlines()
        ),
    }
    for name, content in bad.items():
        (tmp_path / name).write_text(content)
        line = refused(tmp_path / name, tmp_path, capsys)
        assert line.startswith(f"inhabit: {tmp_path / name}: "), line
        assert line.count(name) == 1, line
