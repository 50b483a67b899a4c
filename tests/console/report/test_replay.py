"""The viewer gets the simulator's poses."""

import base64

import mujoco
import numpy as np
import pytest

from console.evaluation.stepping import Track
from console.report import scene3d
from tests.support.console.recordings import take
from world.furniture.catalogue import catalogue
from world.objects.furniture_bank import FurnitureBank


def track() -> Track:
    shown = take(6)
    shown.qpos[:, 0] = np.linspace(0, 1, 6)
    model = FurnitureBank([catalogue("test", 1)[0].scaled(1.1)]).models[0]
    return Track(shown, np.zeros((6, 114), np.float32), np.linspace(1, 0.5, 6), model, 6)


def test_the_viewer_gets_the_simulators_poses() -> None:
    shown = track()
    data = scene3d.drawable(shown)
    raw = np.frombuffer(base64.b64decode(data["poses"]), "<i2")
    poses = raw.reshape(6, data["bodies"], 7)
    model, state = shown.model, mujoco.MjData(shown.model)
    state.qpos[:] = shown.take.qpos[3]
    state.mocap_pos[0] = shown.take.mocap_pos[3]
    mujoco.mj_forward(model, state)
    for shape in data["shapes"]:
        assert shape["kind"] in ("sphere", "capsule", "box")
    root = poses[3, data["root"]]
    assert root[:3] / 1000 == pytest.approx(state.xpos[1], abs=6e-4)
    assert root[3:] / 32767 == pytest.approx(state.xquat[1], abs=4e-5)
    # every visible geom stands where body pose and local pose put it
    place = next(s for s in data["shapes"] if s["kind"] == "sphere" and s["size"][0] == 0.095)
    at = poses[3, place["body"]]
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, at[3:] / 32767)
    head = at[:3] / 1000 + rotation.reshape(3, 3) @ place["pos"]
    assert head == pytest.approx(state.geom("head").xpos, abs=2e-3)
    used = len(shown.take.boxes)
    assert sum(shape["kind"] == "box" for shape in data["shapes"]) == used + 2  # and two feet
