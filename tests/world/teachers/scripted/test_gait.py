"""The gait: steps in the physics and of an inverted pendulum."""

import math
from dataclasses import fields

import pytest
import torch

from tests.support.walking import Walk, feet_at
from world import rotations
from world.character import model as character
from world.teachers.scripted.gait import OMEGA, SHIFT, STEP, Footing, Gait, wrapped
from world.teachers.scripted.whole_body import Mass


@pytest.fixture(autouse=True)
def one_thread() -> None:
    torch.set_num_threads(1)


def test_it_walks_turns_and_comes_to_rest() -> None:
    walk = Walk(3)
    # ahead; about to the left on the spot; backwards to the right
    orders = torch.tensor([[0.3, 0.0, 0.0], [0.0, 0.0, 0.4], [-0.15, -0.05, 0.0]])
    walk.go(orders, stop=False, steps=20 + 8 * 14)
    middle, yaw_rad = walk.feet.middle(0.0), walk.yaw_rad
    assert middle[0, 0] > 1.5 and middle[0, 1].abs() < 0.5
    assert middle[1].norm() < 0.6 and (wrapped(yaw_rad[1]).abs() > 1.0)
    assert middle[2, 0] < -0.5 and middle[2, 1] < 0.0
    assert (yaw_rad[[0, 2]].abs() < 0.4).all(), "no command corrects the drift"
    walk.go(torch.zeros(3, 3), stop=True, steps=90)
    assert walk.gait.standing.all()
    rests = walk.feet
    walk.go(torch.zeros(3, 3), stop=True, steps=60)
    assert walk.gait.standing.all()
    assert (walk.scenes.qpos[:, 2] > 0.8).all(), "none fell"
    assert (walk.feet.soles - rests.soles).norm(dim=2).max() < 0.02, "feet that rest stay"
    assert walk.scenes.qvel[:, :2].norm(dim=1).max() < 0.05
    across = rotations.turn_back(rests.heading, rests.soles[:, 1, :2] - rests.soles[:, 0, :2])
    assert (across[:, 0].abs() < 0.13).all() and (across[:, 1] > 0.1).all()


def test_an_observing_gait_follows_the_steps_of_another() -> None:
    """From any state it soon has the same foot in the air at the same time."""
    walk, n = Walk(8), 8
    order = torch.tensor([[0.25, 0.0, 0.0]]).repeat(n, 1)
    walk.go(order, stop=False, steps=50)
    other = Gait(n)
    # two stand; six are in a step of either foot, at different times of it
    other.mode[2:], other.swing[5:] = STEP, 1
    other.time[2:] = torch.tensor([0.0, 3.0, 7.0, 0.0, 3.0, 7.0]).double()
    amiss = (other.time - walk.gait.time).abs() > 1.0
    assert (amiss | (other.swing != walk.gait.swing) | (other.mode != STEP)).sum() >= 5
    agree = torch.stack(walk.go(order, stop=False, steps=90, observer=other))
    assert (walk.scenes.qpos[:, 2] > 0.7).all(), "none fell"
    # contact may be observed a control step later
    assert agree[30:].float().mean() > 0.85


@pytest.mark.parametrize("walked", [0.0, 0.3])
def test_the_divergent_component_repeats_itself_under_the_pendulum(walked: float) -> None:
    """A point mass that falls over each foot and is caught by the next one walks as commanded,
    within 15 %, since the pressure changes once a control step."""
    gait, order = Gait(1), torch.tensor([[walked, 0.0, 0.0]]).double()
    stop = torch.zeros(1, dtype=torch.bool)
    soles = torch.tensor([[[0.0, -0.1, 0.0], [0.0, 0.1, 0.0]]]).double()
    ankle = torch.tensor([-0.045, 0.0, 0.05]).double()
    place, velocity = torch.tensor([[0.0, 0.0]]).double(), torch.zeros(1, 2).double()
    landed = []
    for _ in range(20 * 14):
        ahead = torch.tensor([[1.0, 0.0]]).double()
        feet = Footing(soles + ankle, soles, torch.zeros(1, 2).double(), ahead)
        swung = int(gait.swing)
        stride = gait.advance(feet, Mass(torch.ones(1), place, velocity), order, stop)
        side = stride.air[0].nonzero().flatten()
        if len(side):
            soles = soles.clone()
            soles[:, int(side)] += stride.velocity / character.CONTROL_HZ
        elif swung != int(gait.swing):
            landed.append(soles[0, swung].clone())
        # x'' = ω² (x − u), over a control step by its closed form
        off, t = place - stride.pressure, OMEGA / character.CONTROL_HZ
        place = stride.pressure + off * math.cosh(t) + velocity / OMEGA * math.sinh(t)
        velocity = off * OMEGA * math.sinh(t) + velocity * math.cosh(t)
    steps = torch.stack(landed[-7:]).diff(dim=0)
    torch.testing.assert_close(steps[:, 0], torch.full((6,), walked).double(), atol=0.045, rtol=0)
    width = torch.full((6,), 0.22).double()
    torch.testing.assert_close(steps[:, 1].abs(), width, atol=0.03, rtol=0)


def test_a_long_weight_shift_ends_in_no_fall_ahead_or_back() -> None:
    """Inverted pendulums ahead and back, held sideways, with the divergent component behind, over
    and before the soles: the centre of pressure brings them over the soles. Without that they would
    fall by 27 cm."""
    gait, n, one = Gait(3), 3, feet_at(0.0, 0.0, 0.0)
    feet = Footing(*(getattr(one, f.name).repeat_interleave(n, dim=0) for f in fields(Footing)))
    gait.mode[:], gait.swing[:] = SHIFT, 1
    middle = feet.middle(0.0)
    off, velocity = torch.tensor([-0.03, 0.0, 0.03]).double(), torch.zeros(n).double()
    for _ in range(20):
        place = middle + off[:, None] * feet.heading
        mass = Mass(torch.ones(n), place, velocity[:, None] * feet.heading)
        stride = gait.advance(feet, mass, torch.zeros(n, 3).double(), torch.zeros(n) > 0)
        assert (gait.mode == SHIFT).all()
        push = stride.pressure - middle
        assert (push[:, 1] > 0.05).all(), "below the left foot, which will lift"
        t = OMEGA / character.CONTROL_HZ
        from_it = off - push[:, 0]
        off = push[:, 0] + from_it * math.cosh(t) + velocity / OMEGA * math.sinh(t)
        velocity = from_it * OMEGA * math.sinh(t) + velocity * math.cosh(t)
    torch.testing.assert_close(off + velocity / OMEGA, torch.zeros(n).double(), atol=2e-3, rtol=0)
