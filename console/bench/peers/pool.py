"""Control steps of a batch of scenes by MuJoCo's own Batch or by UniLab's BatchEnvPool.

It speaks the protocol (protocol.py), but imports nothing of this project: UniLab's pool needs a
MuJoCo older than ours. Standard input begins with {"kind", "model": MJCF file, "states": npz of
qpos, qvel, ctrl, mocap_pos and mocap_quat, "after": npy file, "threads", "substeps"}. Every step
begins from those states; `after` receives qpos and qvel [n, nq + nv] of the first.
"""

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

Step = Callable[[], np.ndarray]


def by_batch(model: Any, states: dict[str, np.ndarray], threads: int, substeps: int) -> Step:
    """Return a control step by MuJoCo's Batch, as world.scene.batch has it."""
    from mujoco.batch import Batch

    n = len(states["qpos"])
    batch = Batch(model, n, threads)
    arrays = {name: batch.bind(name) for name in states}

    def step() -> np.ndarray:
        for name, array in arrays.items():
            array[:] = states[name].reshape(array.shape)
        batch.step(nstep=substeps)
        return np.concatenate((arrays["qpos"], arrays["qvel"]), axis=1)

    return step


def by_unilab(model: Any, states: dict[str, np.ndarray], threads: int, substeps: int) -> Step:
    """Return a control step by UniLab's pool; the furniture's pose goes in as a control."""
    from mujoco_uni.batch_env import BatchEnvPool  # pyright: ignore[reportMissingImports]

    kinds = mujoco.mjtState
    physics = int(kinds.mjSTATE_FULLPHYSICS)
    driven = int(kinds.mjSTATE_CTRL | kinds.mjSTATE_MOCAP_POS | kinds.mjSTATE_MOCAP_QUAT)
    n, data = len(states["qpos"]), mujoco.MjData(model)
    before = np.zeros((n, mujoco.mj_stateSize(model, physics)))
    control = np.zeros((n, substeps, mujoco.mj_stateSize(model, driven)))
    for scene in range(n):
        for name, values in states.items():
            held = getattr(data, name)
            held[:] = values[scene].reshape(held.shape)
        mujoco.mj_getState(model, data, before[scene], physics)
        mujoco.mj_getState(model, data, control[scene, 0], driven)
    control[:] = control[:, :1]
    pool = BatchEnvPool(model, nbatch=n, nthread=threads)

    def step() -> np.ndarray:
        after = pool.step(before, nstep=substeps, control_spec=driven, control=control)
        return after[:, 1:]  # without the time

    return step


KINDS = {"inhabit_pool": by_batch, "unilab_pool": by_unilab}


def memory_gb() -> tuple[float, float]:
    """Return the resident memory of this process and its peak, GB."""
    words = (line.split() for line in Path("/proc/self/status").read_text().splitlines())
    found = {
        word[0]: int(word[1]) * 1024 / 1e9 for word in words if word[0][:4] in ("VmRS", "VmHW")
    }
    return found["VmRSS:"], found["VmHWM:"]


def main() -> None:
    """Answer the lines of standard input until it ends."""
    given = json.loads(sys.stdin.readline())
    model = mujoco.MjModel.from_xml_path(given["model"])
    with np.load(given["states"]) as file:
        states = {name: file[name] for name in file.files}
    step = KINDS[given["kind"]](model, states, given["threads"], given["substeps"])
    np.save(given["after"], step())
    print(json.dumps({"ready": True}), flush=True)
    for line in sys.stdin:
        seconds = float(json.loads(line)["seconds"])
        steps, began, processor, spent = 0, time.perf_counter(), time.process_time(), 0.0
        while steps == 0 or spent < seconds:
            step()
            steps += 1
            spent = time.perf_counter() - began
        resident, peak = memory_gb()
        turn = {"samples": steps * len(states["qpos"]), "seconds": spent, "iterations": steps}
        turn |= {"processor_s": time.process_time() - processor}
        turn |= {"resident_gb": resident, "peak_gb": peak}
        print(json.dumps(turn), flush=True)


if __name__ == "__main__":
    main()
