"""The stepping pools: a model and states that another MuJoCo reads, and the line without UniLab."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from console.bench.peers import pools
from console.run.experiment import PRESETS
from tests.support.paths import ROOT

EXPERIMENT = replace(PRESETS["fast"], scenes=8, block=8)


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict]:
    return pools.write(EXPERIMENT, tmp_path_factory.mktemp("pools"), 1)


def test_the_states_are_those_of_scenes_that_moved(given: dict[str, dict]) -> None:
    states = np.load(given[pools.OURS]["states"])
    model = mujoco.MjModel.from_xml_path(given[pools.OURS]["model"])
    assert states["qpos"].shape == (8, model.nq) and states["qvel"].shape == (8, model.nv)
    assert np.abs(states["qvel"]).max() > 0.1


def test_a_pool_steps_as_mujoco_does(given: dict[str, dict]) -> None:
    """Each scene against mj_step from the same state."""
    first = given[pools.OURS]
    done = subprocess.run(
        [sys.executable, "-m", "console.bench.peers.pool"],
        input=json.dumps(first) + '\n{"seconds": 0.0}\n',
        capture_output=True,
        text=True,
        env=dict(os.environ, PYTHONPATH=str(ROOT)),
        check=True,
    )
    ready, turn = map(json.loads, done.stdout.splitlines())
    assert ready == {"ready": True} and (turn["samples"], turn["iterations"]) == (8, 1)
    after, states = np.load(first["after"]), np.load(first["states"])
    model = mujoco.MjModel.from_xml_path(first["model"])
    for scene in range(8):
        data = mujoco.MjData(model)
        for name in states.files:
            getattr(data, name)[:] = states[name][scene]
        mujoco.mj_step(model, data, first["substeps"])
        np.testing.assert_allclose(after[scene], [*data.qpos, *data.qvel], atol=1e-9)


def test_the_difference_is_a_median_over_the_scenes(tmp_path: Path) -> None:
    ours = np.zeros((3, 2))
    theirs = np.array([[1e-3, 0.0], [0.0, -2e-3], [0.5, 0.0]])
    np.save(tmp_path / f"{pools.OURS}.npy", ours)
    np.save(tmp_path / f"{pools.UNILAB}.npy", theirs)
    assert pools.difference(tmp_path) == 2e-3


def test_without_unilab_the_line_says_how_to_install_it() -> None:
    line = pools.missing(Path("/bin/false"))
    assert line.startswith("UniLab's stepping pool: not measured: not installed in /bin/false")
    assert "pip install mujoco-uni-runtime==0.5.0" in line and "--peer-python unilab=PATH" in line
