"""Recordings: what is written is read again, what blew up is kept, and both can be drawn."""

import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import imageio.v3 as imageio
import imageio_ffmpeg
import numpy as np
import pytest
import torch

from console.evaluation import trials
from console.recording import format as recording
from console.recording import video
from console.recording.format import Recording, RecordingError, Take, boxes_of
from console.run import assembly
from console.run.experiment import PRESETS
from console.run.metrics import read_metrics
from console.run.nan_dump import BlackBox
from tests.support.paths import ROOT
from world.character import model as character
from world.config import WorldConfig
from world.furniture.catalogue import catalogue

WORLD = WorldConfig(pieces=4, scales=1)


def take(steps: int = 4) -> Take:
    """A character that stands still beside a chair."""
    piece = catalogue("test", 1)[0].scaled(1.1)
    qpos = np.tile(character.standing_qpos(), (steps, 1))
    return Take(
        qpos,
        np.zeros((steps, 34)),
        np.zeros((steps, 28)),
        np.tile([1.0, 0.5, 0.0], (steps, 1)),
        np.tile([1.0, 0.0, 0.0, 0.0], (steps, 1)),
        boxes_of(piece),
        piece.name,
        1.1,
        {"distance_m": 1.0},
    )


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


def test_a_scene_that_blows_up_is_written_down(tmp_path: Path) -> None:
    shard = assembly.shard(WORLD, range(32, 64), 0)
    box = BlackBox(shard, range(32, 64), assembly.training_bank(WORLD).pieces, tmp_path)
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


@pytest.mark.skipif(video.choose_gl() is None, reason="nothing draws offscreen here")
def test_a_video_shows_a_chair_and_a_character(tmp_path: Path) -> None:
    film, strip = tmp_path / "a.mp4", tmp_path / "a.png"
    look = video.Look(width=160, height=128)
    assert video.film(Recording([take(5)], {}), film, look) == 5
    assert imageio.imread(film, index=0).shape == (128, 160, 3)
    video.sheet(Recording([take(5)], {}), strip, 3)
    image = imageio.imread(strip)
    assert image.shape == (240, 720, 3)
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 20


@pytest.mark.parametrize("broken", [1, 2])
def test_an_encoder_that_is_gone_is_started_once_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, broken: int
) -> None:
    encode, begun = imageio_ffmpeg.write_frames, []

    def write_frames(*args, **kwargs):
        begun.append(args)
        if len(begun) <= broken:
            yield
            raise OSError("[Errno 32] Broken pipe")
        yield from encode(*args, **kwargs)

    monkeypatch.setattr(imageio_ffmpeg, "write_frames", write_frames)
    out, look = tmp_path / "a.mp4", video.Look(width=160, height=128)
    if broken == 1:
        assert video.film(Recording([take(5)], {}), out, look) == 5
        assert len(list(imageio.imiter(out))) == 5
    else:
        with pytest.raises(video.VideoError, match=r"cannot write .*Broken pipe"):
            video.film(Recording([take(5)], {}), out, look)
        assert not list(tmp_path.iterdir())
    assert len(begun) == 2


def test_ctrl_c_leaves_a_checkpoint(tmp_path: Path) -> None:
    run = tmp_path / "run"
    asked = [
        "train", "sit", "--run", str(run), "--scenes", "64", "--block", "32", "--threads", "2",
        "--world.pieces", "4", "--world.scales", "1", "--ppo.hidden", "16", "--style.hidden", "16",
        "--clone-passes", "0", "--style.normaliser-samples", "500",
    ]  # fmt: skip
    process = subprocess.Popen([sys.executable, "-m", "console", *asked], cwd=ROOT)
    waited = time.monotonic() + 110
    while not read_metrics(run / "metrics.jsonl") and time.monotonic() < waited:
        time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 130
    last = read_metrics(run / "metrics.jsonl")[-1]["iteration"]
    assert (run / "checkpoints" / "latest").resolve().name == f"{last:06d}"
