"""What a process inherits: OpenGL, temporary folders, homes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT
from world import surroundings

STEPS = """
import json, os
from world import surroundings
from world.character.model import spec
import mujoco
model = spec().compile()
data = mujoco.MjData(model)
mujoco.mj_step(model, data)
print(json.dumps([str(surroundings.missing_gl), os.environ.get("MUJOCO_GL")]))
"""


def python(code: str, **variables: str) -> str:
    """Standard output of a Python process with these variables."""
    kept = {k: v for k, v in os.environ.items() if k not in (surroundings.GL, "INHABIT_MISSING_GL")}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=kept | {"PYTHONPATH": str(ROOT)} | variables,
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return done.stdout


def test_the_simulator_steps_whatever_opengl_is_asked_for() -> None:
    said, value = json.loads(python(STEPS, MUJOCO_GL="nothing"))
    assert said == "MUJOCO_GL=nothing is not there (choose egl, osmesa or glfw)"
    assert value is None
    no_display = {"DISPLAY": "", "WAYLAND_DISPLAY": ""}
    said, value = json.loads(python(STEPS, MUJOCO_GL="glfw", **no_display))
    assert (said, value) == ("MUJOCO_GL=glfw is not there (no display)", None)
    assert json.loads(python(STEPS)) == ["None", None]
    assert json.loads(python(STEPS, MUJOCO_GL="disable")) == ["None", "disable"]


def test_child_processes_know_what_was_asked_for() -> None:
    code = "from world import surroundings; print(surroundings.missing_gl)"
    assert "MUJOCO_GL=x is not there (y)" in python(code, INHABIT_MISSING_GL="x\ny")


WORKS = """
import sys, tempfile, multiprocessing
from world import bounded
from world.surroundings import settle_sockets
settle_sockets()
found = list(bounded.run([bounded.Task("a", (0.5,), bounded.Bounds(60, 60, 1 << 34))], abs, 1))
print(found[0][1].value, multiprocessing.util.get_temp_dir())
"""


def test_processes_start_with_a_long_name_of_the_temporary_folder(tmp_path: Path) -> None:
    long = tmp_path / ("x" * 100)
    long.mkdir()
    value, folder = python(WORKS, TMPDIR=str(long)).split()
    assert value == "0.5"
    assert len(folder) < surroundings.LONGEST and not Path(folder).exists()


def test_a_short_name_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", "/tmp")
    assert surroundings.short_folder() is None
    monkeypatch.setattr("tempfile.tempdir", "/" + 80 * "x")
    assert surroundings.short_folder() == "/tmp"


def test_a_user_without_a_home_has_no_cache(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", no_home)
    assert surroundings.home() is None and surroundings.cache_folder() is None
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert surroundings.cache_folder() == tmp_path / "inhabit"
