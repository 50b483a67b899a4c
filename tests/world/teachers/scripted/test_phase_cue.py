"""The phase cue: shown by the neck and read back from it."""

import pytest
import torch

from tests.support.walking import Walk, bent
from world.character import model as character
from world.teachers.scripted import phase_cue
from world.teachers.scripted.gait import SHIFT, STEP, Gait


@pytest.fixture(autouse=True)
def one_thread() -> None:
    torch.set_num_threads(1)


def test_the_cue_shows_the_step_under_way() -> None:
    """It sways from side to side within the 11 control steps of a step, pitches by 0.7 rad per
    metre and turns with the step."""
    gait, command = Gait(3), torch.tensor([[0.4, 0.05, -0.3]]).repeat(3, 1).double()
    gait.mode[:] = torch.tensor([SHIFT, STEP, STEP])
    gait.swing[:] = torch.tensor([1, 1, 0])
    gait.time[1:] = torch.tensor([4.5, 10.0]).double()
    sways = torch.tensor([-0.15, 0.0, -0.15]).double()
    cue = torch.stack((sways, torch.full((3,), 0.28), torch.full((3,), -0.3)), dim=1)
    torch.testing.assert_close(phase_cue.pose(gait, command), cue.double())


def test_the_step_command_is_read_back_from_the_neck() -> None:
    """In the physics, with a new command for every step, from six control steps after lift-off on:
    the length within 4 cm and the turn within 0.03 rad. Earlier the cue is not readable."""
    walk, n, random = Walk(4), 4, torch.Generator().manual_seed(0)
    most, high = torch.tensor([0.15, 0.0, 0.35]).double(), torch.tensor([0.4, 0.0, 0.4]).double()
    low = torch.tensor([-0.1, 0.0, -0.4]).double()
    order = torch.tensor([[0.2, 0.0, 0.0]]).repeat(n, 1).double()
    early = late = 0
    for _ in range(150):
        walk.go(order, stop=False, steps=1)
        other = torch.full((n, 3), 9.0).double()
        known = phase_cue.read(walk.gait, phase_cue.angles(walk.scenes.qpos), other)
        tells = walk.gait.stepping & (walk.gait.landed | (walk.gait.time >= 6))
        assert torch.equal(known[~tells], other[~tells])
        assert (known[:, 1] == 9.0).all(), "the lateral step is not shown"
        off = (known - order)[tells].abs()
        assert (off[:, 0] < 0.04).all() and (off[:, 2] < 0.03).all()
        early, late = early + int((~tells).sum()), late + int(tells.sum())
        change = most * (2.0 * torch.rand(n, 3, generator=random).double() - 1.0)
        another = torch.maximum(torch.minimum(order + change, high), low)
        anew = walk.gait.stepping & walk.gait.landed
        order = torch.where(anew[:, None], another, order)
    assert early > 100 and late > 100 and (walk.scenes.qpos[:, 2] > 0.7).all()


def test_readings_are_clamped_to_possible_steps() -> None:
    gait, other = Gait(2), torch.full((2, 3), 9.0).double()
    gait.mode[:], gait.time[:] = STEP, 6.0
    cue = phase_cue.angles(bent((0.0, 0.7, -0.78), (0.0, -0.6, 0.78)))
    known = phase_cue.read(gait, cue.double(), other)
    expected = torch.tensor([[0.5, 9.0, -0.7], [-0.3, 9.0, 0.7]]).double()
    torch.testing.assert_close(known, expected)


def test_the_neck_returns_while_standing() -> None:
    walk = Walk(1)
    away, ahead = torch.full((1, 3), -9.0), torch.tensor([[1.0, 0.0]])
    start = bent((0.3, 0.3, -0.3))
    walk.scenes.set_state(torch.arange(1), start, torch.zeros(1, 34), away, ahead)
    walk.go(torch.zeros(1, 3), stop=True, steps=45)
    rest = phase_cue.angles(torch.from_numpy(character.standing_qpos())[None])
    assert walk.gait.standing.all()
    off = phase_cue.angles(walk.scenes.qpos) - rest
    assert off.abs().max() < 0.06, "a fifth of the initial angle"


def test_the_sway_decides_the_first_foot_during_a_weight_shift() -> None:
    """A sway to the left means the left foot, to the right the right foot; only after four control
    steps, within the bounds of the sway, and in no other mode."""
    turns = [(sway, 0.0, 0.0) for sway in (-0.15, 0.15, -0.15, 0.02, 0.6, -0.15)]
    qpos = bent(*turns)
    torch.testing.assert_close(phase_cue.angles(qpos), torch.tensor(turns))
    gait = Gait(6)
    gait.mode[:], gait.time[:] = SHIFT, 4.0
    gait.swing[:] = torch.tensor([0, 1, 0, 1, 1, 0])
    gait.time[2], gait.mode[5] = 3.0, STEP
    assert phase_cue.first_foot(gait, phase_cue.angles(qpos)).tolist() == [1, 0, 0, 1, 1, 0]
