"""`inhabit motions vary`."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from console.app import main
from console.motions import vary
from world.motions import clip_file
from world.motions.synthetic import library
from world.motions.synthetic.carries import carrying


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    here = tmp_path_factory.mktemp("clips")
    carried = carrying(np.random.default_rng(3), (0.25, 0.36, 0.22), (0.25, 0.25), 1.5, 0.6)
    clip_file.write(here / "carried.npz", carried)
    clip_file.write(here / "walked.npz", library.walking(np.random.default_rng(0), 1.0))
    return here


def test_clips_and_their_variants_are_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "varied"
    words = [str(folder), "--stand-m", "0.4", "0.6", "1.9", "--size", "1", "1.2"]
    assert main(["motions", "vary", *words, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "2 clips and 4 variants" in said and "to a stand of 1.9 m" in said
    found = [clip_file.read(path) for path in sorted(out.glob("*.npz"))]
    heights = sorted(
        round(float(c.box.pose[0, 2] - 0.5 * c.box.size_m[2]), 1)
        for c in found
        if c.box is not None and "~" in c.name
    )
    assert heights == [0.4, 0.4, 0.6, 0.6] and len(found) == 6
    assert main(["motions", "vary", *words, "--out", str(out)]) == 1
    assert "--replace" in capsys.readouterr().err
    assert main(["motions", "vary", *words, "--out", str(out), "--replace"]) == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "name the files or folders"),
        (["WALKED"], "no clip carries a box"),
        (["FOLDER", "--size", "0"], "--size"),
        (["FOLDER", "--stand-m", "nan"], "--stand-m"),
    ],
)
def test_what_cannot_be_varied(
    words: list[str], said: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = {"WALKED": str(folder / "walked.npz"), "FOLDER": str(folder)}
    named = [paths.get(word, word) for word in words]
    assert main(["motions", "vary", *named, "--out", str(tmp_path / "out")]) != 0
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_what_is_there_is_found_before_the_work_and_two_of_a_name_are_refused(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(vary, "variants", lambda *_: pytest.fail("variants were made"))
    out = tmp_path / "out"
    out.mkdir()
    (out / "walked.npz").write_bytes(b"mine")
    assert main(["motions", "vary", str(folder), "--out", str(out)]) == 1
    assert f"{out}: already holds walked.npz; --replace" in capsys.readouterr().err
    assert (out / "walked.npz").read_bytes() == b"mine"
    twin = tmp_path / "twin"
    shutil.copytree(folder, twin)
    words = [str(folder), str(twin), "--out", str(tmp_path / "new")]
    assert main(["motions", "vary", *words]) == 2
    assert "two clips have the name carried: vary their folders" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()
