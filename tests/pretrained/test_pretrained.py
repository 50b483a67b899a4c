"""Policies by name; the package ships those that anyone may use, within its size."""

import fnmatch
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import pretrained
from console.app import main
from console.run.directory import RunError, checkpoint_folder
from policy.checkpoints import lineage
from policy.checkpoints.format import read_manifest
from tests.support.paths import ROOT


def test_a_name_is_its_folder_unless_a_path_has_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert checkpoint_folder(Path("sit")) == ROOT / "pretrained" / "sit"
    (tmp_path / "sit").mkdir()
    with pytest.raises(RunError, match="sit holds no checkpoint"):
        checkpoint_folder(Path("sit"))
    with pytest.raises(RunError, match=r"juggle does not exist: .* the name of a policy: carry, "):
        checkpoint_folder(Path("juggle"))
    with pytest.raises(RunError, match="does not exist"):
        checkpoint_folder(Path("../pretrained"))


def test_installed_policies_are_free_and_small() -> None:
    build = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    shipped = [pattern.removesuffix("/*") for pattern in build["package-data"]["pretrained"]]
    assert shipped and all(name in pretrained.names() for name in shipped)
    assert any(fnmatch.fnmatch("pretrained", p) for p in build["packages"]["find"]["include"])
    for name in pretrained.names():
        licence = read_manifest(pretrained.ROOT / name).notes["licence"]
        assert (name in shipped) == ("research" not in licence), (name, licence)
    sizes = [path.stat().st_size for name in shipped for path in (pretrained.ROOT / name).iterdir()]
    assert sum(sizes) < 25e6


def test_stages_are_whole_and_free_but_no_names() -> None:
    """What a training goes on from: with its terms and what it was measured at, outside of the
    wheel (the test of an installed package)."""
    stages = sorted(path.parent for path in (pretrained.ROOT / "stages").glob("*/manifest.json"))
    assert stages and "stages" not in pretrained.names()
    for stage in stages:
        manifest = read_manifest(stage)
        assert manifest.layout.task == stage.name and "research" not in manifest.notes["licence"]
        evaluation = json.loads((stage / "evaluation.json").read_text())
        assert evaluation["seed"] >= 100, "stages are judged on seeds of development"
        assert evaluation["samples"] == manifest.samples and evaluation["trials"] >= 512


def test_the_terms_of_policies_are_whole_sentences_and_name_no_module() -> None:
    for path in pretrained.ROOT.rglob("manifest.json"):
        notes = read_manifest(path.parent).notes
        for origin in lineage.of(notes):
            prose = len(origin.licence.split()) > 10
            assert not prose or origin.licence.endswith((".", ")")), (path, origin)
            # the terms of several data sets in one text
            assert not re.search(r"[^.)]; Licence\b", origin.licence), (path, origin)
        assert not re.search(r"\b(world|console|learner)\.[a-z]", lineage.data(notes)), path


def test_commands_take_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["evaluate", "sit", "--trials", "2", "--quality", "0", "--json", "a.json"]
    assert main(words) == 0
    assert (tmp_path / "a.json").exists()


def test_an_installed_package_holds_whole_policies_and_plays_them_anywhere(tmp_path: Path) -> None:
    """What a wheel holds, used from an empty folder: no folder of a policy without its weights."""
    lib, empty = tmp_path / "lib", tmp_path / "empty"
    empty.mkdir()
    build = ["egg_info", "--egg-base", str(tmp_path), "build_py", "--build-lib", str(lib)]
    made = subprocess.run(
        [sys.executable, "-c", "from setuptools import setup; setup()", "-q", *build],
        cwd=ROOT, capture_output=True, text=True,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    folders = sorted(path.name for path in (lib / "pretrained").iterdir() if path.is_dir())
    assert folders == ["carry", "lie-free", "sit-free", "track", "track-sit", "walk"]
    script = (
        "import pretrained; from console.demo.command import missing, policies\n"
        "found = policies(()); print(pretrained.ROOT); print(*found); print(missing(found))"
    )
    ran = subprocess.run(
        [sys.executable, "-c", script],
        cwd=empty, capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(lib)},
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    where, names, said = ran.stdout.splitlines()
    assert Path(where) == lib / "pretrained" and names == "carry lie sit walk"
    assert said == "", "no task is missing"
