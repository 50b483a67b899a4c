"""`inhabit export` of motions: from recordings and clips, and every refusal in one line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from console.app import main
from console.recording import format as recording
from console.recording.format import Recording
from tests.support.console import gltf, rig_files
from tests.support.console.motions import sits
from tests.support.console.moving_takes import carried, pushed
from world.motions import clip_file
from world.motions.formats import amass, bvh


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "two.msgpack"
    meta = {"task": "sit", "control_hz": 30, "licence": "CC-BY-4.0", "checkpoint": "abc"}
    recording.write(path, Recording([pushed(), carried()], meta))
    return path


def test_a_take_becomes_every_kind_of_file(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outs = {suffix: tmp_path / f"o{suffix}" for suffix in (".glb", ".bvh", ".smpl.npz")}
    for out in outs.values():
        assert main(["export", str(file), str(out), "--take", "1"]) == 0
        assert capsys.readouterr().out == f"{out}: 30 frames, 1.0 s\n"
    found = gltf.read(outs[".glb"])
    assert found.issues == [] and found.json["asset"]["copyright"] == "CC-BY-4.0"
    assert found.node("box") >= 0 and "abc" in found.json["asset"]["extras"]["source"]
    assert bvh.read(outs[".bvh"]).frames == amass.read(outs[".smpl.npz"]).frames == 30
    assert outs[".bvh"].with_name("o.bvh.license").read_text().startswith("CC-BY-4.0\n")


def test_a_clip_goes_onto_a_rig(tmp_path: Path) -> None:
    clip, rig = tmp_path / "c.npz", rig_files.glb(tmp_path / "r.glb", "mixamo")
    clip_file.write(clip, sits())
    out = tmp_path / "o.glb"
    assert main(["export", str(clip), str(out), "--rig", str(rig)]) == 0
    assert gltf.read(out).json["animations"][0]["name"] == "c"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["{file}", "o.glb"], "has 2 takes; choose --take 0 to 1"),
        (["{file}", "o.glb", "--checkpoint", "latest"], "--checkpoint latest: for a policy, and a"),
        (["sit", "o.onnx", "--take", "1"], "--take 1: for a recording, and a policy is exported"),
        (["sit", "o.onnx", "--rest", "t-pose"], "--rest t-pose: it is the choice of a .bvh"),
        (["{file}", "o.glb", "--take", "2"], "--take 2: {file} has 2 takes"),
        (["{file}", "o.glb", "--take", "-1"], "--take -1: must be 0 to"),
        (["{file}", "o.fbx"], "FILE o.fbx: FBX is not written"),
        (["{file}", "o.txt"], "FILE o.txt: unknown suffix '.txt'; choose .onnx for a policy"),
        (["{file}", "o.onnx"], "{file} is a motion: it is exported as .glb"),
        ([__file__, "o.onnx"], "is a file, and no policy: give a run or a checkpoint folder"),
        (["{here}", "o.glb"], "{here}: no recording (.msgpack) or motion clip (.npz)"),
        (["{here}/x.glb", "o.glb"], "{here}/x.glb: no such run, checkpoint folder or file"),
        (["{clip}", "o.glb", "--take", "0"], "--take 0: {clip} is a clip"),
        (["{file}", "{here}", "--take", "0"], "no suffix; choose .onnx"),
        (["{file}", "/nowhere/o.glb", "--take", "0"], None),
    ],
)
def test_wrong_words_are_one_line(
    file: Path, tmp_path: Path, words: list[str], said: str | None,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    clip = tmp_path / "c.npz"
    clip_file.write(clip, sits())
    names = {"file": file, "here": tmp_path, "clip": clip}
    if said is None:
        # a file where a folder should be
        words = [words[0], str(file / "o.glb"), *words[2:]]
        said = "is not a writable folder"
    assert main(["export", *(word.format(**names) for word in words)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and said.format(**names) in error, error
    assert not list(tmp_path.glob("o.*"))


def test_states_that_are_no_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    broken = pushed()
    broken.qpos[3, 2] = np.nan
    path = tmp_path / "nan.msgpack"
    recording.write(path, Recording([replace(broken)], {}))
    assert main(["export", str(path), str(tmp_path / "o.glb")]) == 1
    assert "take 0 has non-finite states" in capsys.readouterr().err
