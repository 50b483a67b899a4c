"""`inhabit motions import` and `check` as a user meets them, bad input above all."""

import json
import os
import pickle
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
    assert main(["motions", "import", str(bvh), "--out", str(out)]) == 1
    assert "--replace" in capsys.readouterr().err
    assert not list(out.glob("*.partial"))


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
    assert "1 clips" in captured.out


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
    line = refused(path, tmp_path, capsys, "--map", str(names))
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
    assert "no such file" in refused(tmp_path / "none", tmp_path, capsys)
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
