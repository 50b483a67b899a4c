"""Motion quality against numbers worked by hand, scipy, and motions whose faults are known."""

import math

import numpy as np
import pytest
import torch
from scipy import signal

from console.evaluation import penetration
from world.character import model as character
from world.furniture.catalogue import catalogue
from world.objects.furniture_bank import FurnitureBank
from world.realism import measures
from world.realism.measures import Motion

HZ = 30.0
STAND = torch.from_numpy(character.standing_qpos())


def standing(frames: int) -> torch.Tensor:
    return STAND.repeat(frames, 1)


def test_feet_that_slide_skate_and_feet_that_stand_or_fly_do_not() -> None:
    qpos = standing(31)
    assert measures.skating(qpos, HZ) == (0.0, 30 * 8)  # eight corners of two soles
    sliding = qpos.clone()
    sliding[:, 0] = torch.arange(31) / HZ * 0.4
    total, count = measures.skating(sliding, HZ)
    assert count == 240 and total / count == pytest.approx(0.4)
    flying = sliding.clone()
    flying[:, 2] += 0.05
    assert measures.skating(flying, HZ) == (0.0, 0)


def test_rolling_over_the_toes_is_not_skating() -> None:
    """The body turns about the line of the toes' corners, which stand still."""
    frames = 16
    qpos = standing(frames)
    angle = torch.linspace(0.0, 0.5, frames, dtype=torch.float64)
    position, rotation = measures.poses(qpos[:1])
    toes = position[0, 11] + rotation[0, 11] @ torch.tensor([0.1335, 0.0, -0.05]).double()
    qpos[:, 3], qpos[:, 5] = (angle / 2).cos(), (angle / 2).sin()
    x, z = float(STAND[0] - toes[0]), float(STAND[2] - toes[2])
    qpos[:, 0] = toes[0] + x * angle.cos() + z * angle.sin()
    qpos[:, 2] = toes[2] - x * angle.sin() + z * angle.cos()
    total, count = measures.skating(qpos, HZ)
    heels = measures.skating(qpos[:2], HZ)[1]
    assert heels == 8 and count < 8 * (frames - 1)  # the heels leave the floor
    assert total / count < 0.03


def test_jerk_of_a_cubic_is_its_third_derivative() -> None:
    t = torch.arange(20, dtype=torch.float64) / HZ
    path = torch.stack((2.0 * t**3, 1.0 - t**2, 0.5 * t), dim=1)[:, None]
    assert measures.jerk(path, HZ).numpy() == pytest.approx(np.full((17, 1), 12.0), rel=1e-6)


def noise(frames: int, seed: int = 0) -> Motion:
    generator = torch.Generator().manual_seed(seed)
    qvel = torch.randn(frames, 34, generator=generator, dtype=torch.float64)
    return Motion(standing(frames), qvel)


def test_the_spectrum_is_welchs() -> None:
    motion = noise(512)
    frequency, power = measures.spectrum([motion], HZ)
    theirs = signal.welch(
        motion.qvel[:, 6:].numpy(), HZ, "hann", measures.WINDOW, detrend="constant", axis=0
    )
    assert frequency == pytest.approx(theirs[0])
    assert power == pytest.approx(theirs[1].mean(1))


def test_a_tremor_is_seen_where_it_is() -> None:
    t = torch.arange(600, dtype=torch.float64) / HZ
    slow = torch.sin(2 * math.pi * 1.0 * t)[:, None].expand(-1, 34)
    fast = torch.sin(2 * math.pi * 9.0 * t)[:, None].expand(-1, 34)
    calm = measures.measure([Motion(standing(600), slow)])
    shaken = measures.measure([Motion(standing(600), slow + fast)])
    assert (
        calm.tremor_share is not None
        and calm.tremor_share < 0.01
        and shaken.tremor_share == pytest.approx(0.5, abs=0.01)
    )
    assert calm.joint_speed_rad_s == pytest.approx(math.sqrt(0.5), rel=1e-2)
    assert shaken.joint_speed_rad_s == pytest.approx(1.0, rel=1e-2)
    assert shaken.seconds == 20.0 and shaken.foot_skate_m_s == 0.0 and shaken.jerk_m_s3 < 1e-6
    ours, theirs = (measures.spectrum([Motion(standing(600), f)], HZ)[1] for f in (slow * 2, slow))
    short = measures.measure([Motion(standing(60), slow[:60])])
    assert short.tremor_share is None and short.seconds == 2.0
    # twice the speed is four times the power: 6.02 dB at every frequency that has any
    top = theirs > 1e-6
    assert measures.spectral_distance_db(ours[top], theirs[top]) == pytest.approx(6.02, abs=0.01)


def test_the_nearest_transition_and_clips_are_no_neighbours_of_their_own() -> None:
    reference = torch.tensor([[0.0, 0.0], [3.0, 4.0], [0.0, 2.0]])
    query = torch.tensor([[0.0, 0.0], [3.0, 0.0]])
    half = 0.5**0.5
    assert measures.nearest(query, reference).tolist() == pytest.approx([0.0, 3 * half])
    labels = (torch.tensor([0, 1]), torch.tensor([0, 1, 2]))
    assert measures.nearest(query, reference, labels).tolist() == pytest.approx(
        [2 * half, 3 * half]
    )


def test_overlap_is_how_far_the_character_was_pushed_into_the_furniture() -> None:
    piece = catalogue("test", 1)[0]
    model = FurnitureBank([piece]).models[0]
    seat = np.array(piece.sit[0].point_m)
    # the pelvis sphere (radius 9 cm, 7 cm above the root) above the seat, then 3 cm into it
    qpos = np.tile(character.standing_qpos(), (3, 1))
    for joint in ("right_hip", "left_hip"):
        address = int(model.joint(joint).qposadr[0])
        qpos[:, address : address + 4] = [0.5**0.5, 0.0, -(0.5**0.5), 0.0]
    qpos[:, :2] = seat[:2]
    qpos[:, 2] = seat[2] + np.array([0.30, 0.02 - 0.03, 1.0])
    place, upright = np.zeros((3, 3)), np.tile([1.0, 0, 0, 0], (3, 1))
    depth = penetration.depth(model, qpos, place, upright, range(3))
    assert depth[0] == 0.0 and depth[2] == 0.0
    # thighs lie 5.5 cm thick about the root's height: 5.5 + 1 cm deep
    assert depth[1] == pytest.approx(0.065, abs=0.005)
