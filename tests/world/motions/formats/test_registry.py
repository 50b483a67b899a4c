"""Which format a file is: by its suffix, by its fields, or none."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from tests.support import small_clips
from world.errors import ChoiceError, ClipError
from world.motions.formats import registry


def test_fields_tell_formats_of_one_suffix_apart(tmp_path: Path) -> None:
    clip = sorted(small_clips.write(tmp_path / "clips").glob("*.npz"))[0]
    np.savez(tmp_path / "a.npz", trans=np.zeros(1), poses=np.zeros(1))
    assert registry.detected(clip) == "clip" and registry.detected(tmp_path / "a.npz") == "amass"
    samp = dict.fromkeys(("pose_est_fullposes", "pose_est_trans", "mocap_framerate"), 0)
    (tmp_path / "s.pkl").write_bytes(pickle.dumps(samp))
    assert registry.detected(tmp_path / "s.pkl") == "samp"
    assert registry.detected(Path("x.BVH")) == "bvh"


def test_an_unknown_joint_is_refused_with_the_choices(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", other=np.zeros(1))
    for path, said in (
        (Path("a.fbx"), r"unknown suffix '\.fbx'; motions come as .*bvh"),
        (tmp_path / "a.npz", "it holds other; expected clip: .*amass: "),
    ):
        with pytest.raises(ClipError, match=said):
            registry.detected(path)
    with pytest.raises(ChoiceError, match="unknown format 'fbx': choose one of acclaim"):
        registry.read(Path("a.bvh"), "fbx")


def test_notes_in_text_files_are_no_motions(tmp_path: Path) -> None:
    (tmp_path / "LICENSE.txt").write_text("Do what you like.")
    (tmp_path / "run.txt").write_text('{"Loop": "wrap", "Frames": []}')
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/walk.bvh").write_text("")
    assert [p.name for p in registry.find([tmp_path])] == ["run.txt", "walk.bvh"]
    assert [p.name for p in registry.find([tmp_path], "bvh")] == ["walk.bvh"]
    for path, said in ((tmp_path / "gone", "no such file"), (tmp_path / "sub", "no motions found")):
        with pytest.raises(ClipError, match=said):
            registry.find([path], "amass")
