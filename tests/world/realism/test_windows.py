"""Window features against motion whose positions and accelerations are known."""

import math

import pytest
import torch

from world.character import model as character
from world.realism import windows
from world.realism.measures import Motion

STAND = torch.from_numpy(character.standing_qpos())
BODIES = len(character.BODIES)


def moving(frames: int, speed: float = 0.0, acceleration: float = 0.0) -> Motion:
    """The standing character moved rigidly along x."""
    t = torch.arange(frames, dtype=torch.float64) / character.CONTROL_HZ
    qpos = STAND.repeat(frames, 1).double()
    qpos[:, 0] += speed * t + 0.5 * acceleration * t**2
    return Motion(qpos, torch.zeros(frames, character.NV))


def parts(rows: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    positions = len(windows.SAMPLED) * BODIES * 3
    return (
        rows[:, :positions].view(len(rows), -1, BODIES, 3),
        rows[:, positions:].view(len(rows), -1, BODIES, 3),
    )


def test_positions_and_accelerations_of_a_parabola() -> None:
    rows = windows.windows(moving(21, 1.2, 3.0))
    assert rows.shape == (2, windows.FEATURES)  # from frames 0 and 5
    position, acceleration = parts(rows)
    t = 5 / character.CONTROL_HZ
    assert position[0, 1, :, 0] - position[0, 0, :, 0] == pytest.approx(1.2 * t + 1.5 * t**2)
    torch.testing.assert_close(acceleration[..., 0], torch.full_like(acceleration[..., 0], 3.0))
    assert acceleration[..., 1:].abs().max() < 1e-2
    assert position[0, 0, 0, 2] == pytest.approx(float(STAND[2]))  # heights are above the floor


def test_the_place_and_heading_of_a_motion_do_not_matter() -> None:
    motion = moving(40, 1.0)
    turned = motion.qpos.clone()
    turned[:, 0], turned[:, 1] = 5.0 - motion.qpos[:, 1], motion.qpos[:, 0] - 2.0
    turned[:, 3], turned[:, 6] = math.cos(math.pi / 4), math.sin(math.pi / 4)
    assert motion.qpos[0, 3] == 1.0
    torch.testing.assert_close(
        windows.windows(Motion(turned, motion.qvel)), windows.windows(motion), atol=1e-4, rtol=0
    )


def test_windows_name_their_motions_and_short_motions_have_none() -> None:
    rows, index = windows.of_all([moving(16), moving(15), moving(26)])
    assert index.tolist() == [0, 2, 2, 2] and len(rows) == 4
    assert windows.of_all([])[0].shape == (0, windows.FEATURES)
