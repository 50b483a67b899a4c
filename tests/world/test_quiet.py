"""Warnings and timers of the simulator."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from world import quiet
from world.character.model import spec

STEP = int(mujoco.mjtTimer.mjTIMER_STEP)


def test_a_warning_is_counted_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    model = spec().compile()
    data = mujoco.MjData(model)
    data.qvel[:] = 1e30
    mujoco.mj_step(model, data)
    assert int(data.warning.number.sum()) > 0
    assert not list(tmp_path.iterdir())


def test_steps_are_timed_only_where_the_timers_are_asked_for() -> None:
    model = spec().compile()
    states, seconds = [], []
    for timed in (False, True, False):
        data = mujoco.MjData(model)
        if timed:
            with quiet.timers():
                mujoco.mj_step(model, data, 20)
        else:
            mujoco.mj_step(model, data, 20)
        states.append(data.qvel.copy())
        seconds.append(data.timer[STEP].duration)
    assert seconds[0] == seconds[2] == 0.0 < seconds[1]
    np.testing.assert_array_equal(states[0], states[1])
    np.testing.assert_array_equal(states[0], states[2])
