"""Recordings: what is written is read again, what blew up is kept, and both can be drawn."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from console.evaluation import trials
from console.recording import format as recording
from console.recording.format import Recording, RecordingError
from console.run import assembly
from console.run.experiment import PRESETS
from console.run.nan_dump import NanDump
from tests.support.console.recordings import take
from world.character import model as character
from world.config import WorldConfig
from world.furniture.catalogue import catalogue

WORLD = WorldConfig(pieces=4, scales=1)


def test_a_recording_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "a.msgpack"
    recording.write(path, Recording([take()], {"task": "sit"}))
    found = recording.read(path)
    assert found.meta == {"task": "sit"}
    for name in recording.ARRAYS:
        assert np.array_equal(getattr(found.takes[0], name), getattr(take(), name))
    assert found.takes[0].meta == {"distance_m": 1.0}
    used = recording.model_of(found.takes[0]).geom("slot0")
    assert used.pos == pytest.approx(take().boxes[0][:3])


def test_a_damaged_recording_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.msgpack"
    recording.write(path, Recording([take()], {}))
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(RecordingError, match="damaged"):
        recording.read(path)
    path.write_bytes(b"\x80")
    with pytest.raises(RecordingError, match="not a recording"):
        recording.read(path)
    with pytest.raises(RecordingError, match="cannot read"):
        recording.read(tmp_path / "none")
    for shape in ((2, 43), (4, 7)):
        recording.write(path, Recording([replace(take(), ghost=np.zeros(shape))], {}))
        with pytest.raises(RecordingError, match=r"take 0: ghost is .*, not \[4, 43\]"):
            recording.read(path)
    recording.write(path, Recording([replace(take(), ghost=np.zeros((4, 43)))], {}))
    assert recording.read(path).takes[0].ghost.shape == (4, 43)


def test_a_scene_that_blows_up_is_written_down(tmp_path: Path) -> None:
    shard = assembly.shard(WORLD, range(32, 64), 0)
    box = NanDump(shard, range(32, 64), assembly.training_bank(WORLD).pieces, tmp_path)
    still = torch.zeros(32, 28)
    box.step(still)
    state = shard.state_dict()
    state["physics_qvel"][3, 10] = 1e6
    shard.load_state_dict(state)
    before = state["physics_qpos"][3]
    step = box.step(still)
    assert step.finite.tolist().count(False) == 1 and not step.finite[3]
    found = recording.read(tmp_path / f"broken-35-{box.clock}.msgpack")
    assert found.meta["reason"] == "not finite" and found.meta["scene"] == 35
    assert np.array_equal(found.takes[0].qpos[-1], before.numpy())
    assert found.takes[0].qvel[-1, 10] == 1e6
    for values in box.observe():
        assert bool(values.isfinite().all())


def test_trials_are_the_seeds_alone() -> None:
    pieces = catalogue("test")
    few, many = trials.manifest(pieces, 50, 3), trials.manifest(pieces, 500, 3)
    assert np.array_equal(few.distance_m, many.distance_m[:50])
    assert [p.name for p in few.pieces] == [p.name for p in many.pieces[:50]]
    assert 1.0 <= many.distance_m.min() < 1.2 and 9.8 < many.distance_m.max() <= 10.0
    assert 0.8 <= many.scale.min() < 0.81 and 1.19 < many.scale.max() <= 1.2
    # Every tenth of the circle, for where the piece is and for how it is turned.
    for angle in (many.bearing_rad, many.facing_rad):
        assert np.histogram(angle, 10, (0, 2 * np.pi))[0].min() > 25
    assert not np.array_equal(few.distance_m, trials.manifest(pieces, 50, 4).distance_m)


def test_a_trial_starts_where_its_manifest_says() -> None:
    chosen = trials.manifest(catalogue("test"), 8, 0)
    student = assembly.learner(
        replace(PRESETS["fast"], ppo=replace(PRESETS["fast"].ppo, hidden=(16,)))
    )
    results = trials.run(WORLD, student.weights(), chosen, 2, 1, record=8)
    student.close()
    for i, taken in enumerate(results.takes):
        sit = chosen.pieces[i].scaled(float(chosen.scale[i])).sit[0]
        w, _, _, z = taken.mocap_quat[0]
        yaw = 2 * np.arctan2(z, w)
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        place = taken.mocap_pos[0, :2] + turn @ np.array(sit.point_m[:2])
        bearing, distance = chosen.bearing_rad[i], chosen.distance_m[i]
        wanted = distance * np.array([np.cos(bearing), np.sin(bearing)])
        assert place == pytest.approx(wanted, abs=1e-4)
        facing = (yaw + sit.facing_rad - chosen.facing_rad[i] + np.pi) % (2 * np.pi) - np.pi
        assert facing == pytest.approx(0.0, abs=1e-4)
        height = sit.point_m[2] + 0.075 - character.standing_qpos()[2]
        assert results.error_m[i, 0] == pytest.approx(np.hypot(distance, height), abs=0.05)
