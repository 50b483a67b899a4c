"""What a synthesis holds: furniture, balls and boxes that move."""

from dataclasses import replace
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest

from console.recording import format as recording
from console.synthesis import files as motion_files
from console.video import drawing, rendering
from tests.support.console.syntheses import command, made
from tests.support.policy_cases import make
from world.motions import load


@pytest.mark.skipif(rendering.choose_gl() is None, reason="nothing draws offscreen here")
def test_a_film_has_every_frame_and_its_balls(tmp_path: Path) -> None:
    flags = command("sit", "low-stool-test-000", seconds=0.5, perturb="projectiles", seed=1)
    motion = made(make(), replace(flags, to_the_end=True))
    film, states = tmp_path / "a.mp4", tmp_path / "a.msgpack"
    motion_files.write(film, motion)
    motion_files.write(states, motion)
    images = imageio.imread(film)
    assert images.shape == (16, 480, 640, 3)
    take = recording.read(states).takes[0]
    there = np.isfinite(take.balls[-1, :, 0])
    assert motion.summary.balls_thrown == 15 and there.any()
    look = drawing.Look(width=320, height=240, captions=False)

    def red(shown: recording.Take) -> int:
        (image,) = drawing.draw(shown, look, [len(take) - 1])
        r, g, b = np.moveaxis(image.astype(int), -1, 0)
        return int(((r > 90) & (r > 2 * g) & (r > 2 * b)).sum())

    assert red(take) > 10 and red(replace(take, balls=np.full_like(take.balls, np.nan))) == 0


def test_furniture_that_moves_moves_in_the_recording(tmp_path: Path) -> None:
    flags = command("sit", "chair-test-003", seconds=1.0, perturb="moved", seed=5, start="0.5,0,0")
    motion = made(make(), replace(flags, to_the_end=True, at="0.1,0.2,30"))
    take = motion.track.take
    np.testing.assert_allclose(take.mocap_pos[0], [0.1, 0.2, 0.0], atol=1e-6)
    yaw = 2 * np.arctan2(take.mocap_quat[0, 3], take.mocap_quat[0, 0])
    assert np.rad2deg(yaw) == pytest.approx(30.0)
    shift = np.linalg.norm(motion.targets[-1].point[0, :2] - motion.targets[0].point[0, :2])
    assert motion.summary.displaced and 0.5 - 1e-3 <= shift <= 1.5 + 1e-3


def test_a_box_is_carried_along_in_every_file(tmp_path: Path) -> None:
    served = make(2, "carry", "carry")
    flags = command("carry", "box", seconds=0.3, scale=1.2, to="2,1,0.7", at="0.5,0,90")
    motion = made(served, replace(flags, box_kg=2.5, to_the_end=True))
    model = motion.track.model
    assert model.body("box").mass[0] == pytest.approx(2.5)
    for suffix in (".npz", ".bvh", ".html", ".msgpack"):
        motion_files.write(tmp_path / f"a{suffix}", motion)
    clip = load.read(tmp_path / "a.npz")
    assert clip.box is not None and not clip.box.held.any() and clip.seat is None
    np.testing.assert_allclose(clip.box.size_m, 1.2 * np.array([0.35, 0.5, 0.3]), rtol=1e-6)
    np.testing.assert_allclose(clip.box.pose[0, :3], [0.5, 0.0, 0.6 + 0.18], atol=1e-5)
    half = np.sqrt(0.5)
    np.testing.assert_allclose(np.abs(clip.box.pose[0, 3:]), [half, 0, 0, half], atol=1e-5)
    take = recording.read(tmp_path / "a.msgpack").takes[0]
    np.testing.assert_allclose(take.stand, [2.0, 1.0, 0.7], atol=1e-5)
    assert take.qpos.shape == (10, 50)
    error = np.linalg.norm(np.array([2.0, 1.0, 0.88]) - [0.5, 0.0, 0.78])
    assert motion.frames[0].error_m == pytest.approx(error, abs=1e-5)
