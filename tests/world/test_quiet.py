"""Warnings of the simulator."""

from pathlib import Path

import mujoco
import pytest

from world.character.model import spec


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
