"""UniLab's stepping pool against MuJoCo's Batch, which our scenes use, on the same states."""

import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from console.run import assembly
from console.run.experiment import Experiment
from world import random_streams
from world.character.model import NU, SUBSTEPS
from world.scene.model import scene_spec

#: The pool's package, which needs mujoco < 3.12 and so cannot be in our extra.
DISTRIBUTION, VERSION = "mujoco-uni-runtime", "0.5.0"
NAME = "unilab"
OURS, UNILAB = "inhabit_pool", "unilab_pool"
#: Control steps from the initial states to those that are stepped.
STEPS = 20
_STATES = ("qpos", "qvel", "ctrl", "mocap_pos", "mocap_quat")


def missing(interpreter: Path) -> str:
    """Return why UniLab's pool cannot be measured in an interpreter, or ""."""
    code = f"import importlib.metadata as m; print(m.version({DISTRIBUTION!r}))"
    asked = subprocess.run([str(interpreter), "-c", code], capture_output=True, check=False)
    if asked.returncode == 0:
        return ""
    return (
        f"UniLab's stepping pool: not measured: not installed in {interpreter}: pip install"
        f" {DISTRIBUTION}=={VERSION} in an environment of its own (it needs mujoco < 3.12), and"
        f" --peer-python {NAME}=PATH"
    )


def write(experiment: Experiment, folder: Path, threads: int) -> dict[str, dict[str, object]]:
    """Write a model and states of sit scenes with one chair; return the first line of each pool."""
    world = replace(experiment.world, pieces=1, scales=1, objects=())
    bank = assembly.training_bank(world)
    # a keyword newer than UniLab's MuJoCo; the actuators' numbers stand beside it
    text = scene_spec(bank.pieces[0]).to_xml().replace(' input="pos"', "")
    (folder / "scene.xml").write_text(text)
    shard = assembly.shard(world, range(experiment.scenes), experiment.seed)
    ids, sigma = torch.arange(experiment.scenes), experiment.ppo.sigma[0][1]
    for step in range(STEPS):
        shard.step(sigma * random_streams.normal(experiment.seed, ids, step, NU))
    state = shard.state_dict()
    states: dict[str, Any] = {k: state[f"physics_{k}"].numpy() for k in _STATES}
    np.savez(folder / "states.npz", **states)
    return {
        name: {
            "kind": name,
            "model": str(folder / "scene.xml"),
            "states": str(folder / "states.npz"),
            "after": str(folder / f"{name}.npy"),
            "threads": threads,
            "substeps": SUBSTEPS,
        }
        for name in (OURS, UNILAB)
    }


def difference(folder: Path) -> float:
    """Return the greatest difference of a coordinate or velocity after a step between the pools,
    the median over the scenes."""
    ours, theirs = (np.load(folder / f"{name}.npy") for name in (OURS, UNILAB))
    return float(np.median(np.abs(ours - theirs).max(axis=1)))
