"""The porter: stepping, and boxes that it picks up, carries and puts down, in the physics."""

import math
from dataclasses import fields, replace

import pytest
import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.objects import grasp
from world.objects.box_bank import BoxBank, resting
from world.scene.batch import Scenes
from world.scene.box import box
from world.scene.model import compile_scene
from world.scene.target import BoxState
from world.tasks.carry import Carry
from world.teachers import handling, path, phase_cue
from world.teachers import motion as mover
from world.teachers.carry import Phase, Porter
from world.teachers.gait import OMEGA, SHIFT, STEP, Footing, Gait, unit, wrapped
from world.teachers.motion import Pace, Reach
from world.teachers.whole_body import BODY_KG, Figure, Load, Mass


@pytest.fixture(autouse=True)
def one_thread() -> None:
    torch.set_num_threads(1)


class Walk:
    """n characters on an empty floor who go as they are told; the hands hang."""

    def __init__(self, n: int) -> None:
        self.n, self.gait = n, Gait(n)
        self.scenes = Scenes([compile_scene(None)] * n, 0.35, 3.0)
        standing = torch.from_numpy(character.standing_qpos()).float()[None].repeat(n, 1)
        away, ahead = torch.full((n, 3), -9.0), torch.tensor([[1.0, 0.0]]).repeat(n, 1)
        self.scenes.set_down(torch.arange(n), standing, torch.zeros(n, 34), away, ahead)

    def go(
        self, wish: Tensor, stop: bool, steps: int, looks_on: Gait | None = None
    ) -> list[Tensor]:
        """[n] bool, of each step: whether a gait that looks on has the same foot in the air, less
        than two control steps earlier or later."""
        agree: list[Tensor] = []
        n, nothing = self.n, torch.zeros(self.n, 2, 3).double()
        none = torch.zeros(n, dtype=torch.bool)
        hang = Reach(
            none, none, nothing, nothing, nothing, nothing[:, 0, 0], nothing[:, 0], nothing
        )
        for _ in range(steps):
            figure = Figure.of(self.scenes.qpos, self.scenes.qvel)
            feet = Footing.of(figure)
            mass = Mass.of(figure, Load(torch.zeros(n), nothing[:, 0]))
            stride = self.gait.advance(feet, mass, wish.double(), torch.full((n,), stop))
            if looks_on is not None:
                looks_on.advance(feet, mass, wish.double(), torch.full((n,), stop))
                same = (looks_on.swing == self.gait.swing) & (looks_on.mode == self.gait.mode)
                agree.append(same & ((looks_on.time - self.gait.time).abs() < 2.0))
            told = phase_cue.pose(self.gait, wish.double())
            pace = Pace(torch.full((n,), 0.8).double(), figure.velocity[:, :2], told)
            self.scenes.drive(mover.move(figure, feet, mass, stride, hang, pace))
        return agree

    @property
    def feet(self) -> Footing:
        return Footing.of(Figure.of(self.scenes.qpos, self.scenes.qvel))

    @property
    def yaw_rad(self) -> Tensor:
        heading = self.feet.heading
        return torch.atan2(heading[:, 1], heading[:, 0])


def test_it_walks_turns_and_comes_to_rest() -> None:
    walk = Walk(3)
    # ahead; about to the left on the spot; backwards to the right
    orders = torch.tensor([[0.3, 0.0, 0.0], [0.0, 0.0, 0.4], [-0.15, -0.05, 0.0]])
    walk.go(orders, stop=False, steps=20 + 8 * 14)
    middle, yaw_rad = walk.feet.middle(0.0), walk.yaw_rad
    assert middle[0, 0] > 1.5 and middle[0, 1].abs() < 0.5
    assert middle[1].norm() < 0.6 and (wrapped(yaw_rad[1]).abs() > 1.0)
    assert middle[2, 0] < -0.5 and middle[2, 1] < 0.0
    assert (yaw_rad[[0, 2]].abs() < 0.4).all(), "nobody tells them where they have drifted to"
    walk.go(torch.zeros(3, 3), stop=True, steps=90)
    assert walk.gait.stands.all()
    rests = walk.feet
    walk.go(torch.zeros(3, 3), stop=True, steps=60)
    assert walk.gait.stands.all()
    assert (walk.scenes.qpos[:, 2] > 0.8).all(), "nobody fell"
    assert (walk.feet.soles - rests.soles).norm(dim=2).max() < 0.02, "feet that rest stay"
    assert walk.scenes.qvel[:, :2].norm(dim=1).max() < 0.05
    across = rotations.turn_back(rests.heading, rests.soles[:, 1, :2] - rests.soles[:, 0, :2])
    assert (across[:, 0].abs() < 0.13).all() and (across[:, 1] > 0.1).all()


def test_a_gait_that_looks_on_goes_along() -> None:
    """Whatever it took to be under way, the steps that another one makes are its own soon."""
    walk, n = Walk(8), 8
    order = torch.tensor([[0.25, 0.0, 0.0]]).repeat(n, 1)
    walk.go(order, stop=False, steps=50)
    other = Gait(n)
    # those stand; these are about a step of either foot, at any time of it
    other.mode[2:], other.swing[5:] = STEP, 1
    other.time[2:] = torch.tensor([0.0, 3.0, 7.0, 0.0, 3.0, 7.0]).double()
    amiss = (other.time - walk.gait.time).abs() > 1.0
    assert (amiss | (other.swing != walk.gait.swing) | (other.mode != STEP)).sum() >= 5
    agree = torch.stack(walk.go(order, stop=False, steps=90, looks_on=other))
    assert (walk.scenes.qpos[:, 2] > 0.7).all(), "nobody fell"
    # a foot that lands may be seen to a step later
    assert agree[30:].float().mean() > 0.85


def test_the_neck_tells_the_step_that_is_made() -> None:
    """It sways from one side to the other within the 11 control steps of a step, nods by 0.7 rad a
    metre, turns as the step does."""
    gait, wish = Gait(3), torch.tensor([[0.4, 0.05, -0.3]]).repeat(3, 1).double()
    gait.mode[:] = torch.tensor([SHIFT, STEP, STEP])
    gait.swing[:] = torch.tensor([1, 1, 0])
    gait.time[1:] = torch.tensor([4.5, 10.0]).double()
    sways = torch.tensor([-0.15, 0.0, -0.15]).double()
    told = torch.stack((sways, torch.full((3,), 0.28), torch.full((3,), -0.3)), dim=1)
    torch.testing.assert_close(phase_cue.pose(gait, wish), told.double())


def test_a_walker_remembers_what_its_neck_tells() -> None:
    """In the physics, where every step is another one, six control steps after a foot lifted: the
    length within 4 cm, the turn within 0.03 rad, whatever it remembers otherwise; before that it
    tells nothing yet."""
    walk, n, random = Walk(4), 4, torch.Generator().manual_seed(0)
    most, high = torch.tensor([0.15, 0.0, 0.35]).double(), torch.tensor([0.4, 0.0, 0.4]).double()
    low = torch.tensor([-0.1, 0.0, -0.4]).double()
    order = torch.tensor([[0.2, 0.0, 0.0]]).repeat(n, 1).double()
    early = late = 0
    for _ in range(150):
        walk.go(order, stop=False, steps=1)
        other = torch.full((n, 3), 9.0).double()
        known = phase_cue.read(walk.gait, phase_cue.angles(walk.scenes.qpos), other)
        tells = walk.gait.walks & (walk.gait.landed | (walk.gait.time >= 6))
        assert torch.equal(known[~tells], other[~tells])
        assert (known[:, 1] == 9.0).all(), "aside it tells nothing"
        off = (known - order)[tells].abs()
        assert (off[:, 0] < 0.04).all() and (off[:, 2] < 0.03).all()
        early, late = early + int((~tells).sum()), late + int(tells.sum())
        change = most * (2.0 * torch.rand(n, 3, generator=random).double() - 1.0)
        another = torch.maximum(torch.minimum(order + change, high), low)
        anew = walk.gait.walks & walk.gait.landed
        order = torch.where(anew[:, None], another, order)
    assert early > 100 and late > 100 and (walk.scenes.qpos[:, 2] > 0.7).all()


def bent(*angles: tuple[float, float, float]) -> Tensor:
    """[n, 43]: stands with the neck turned about x, y and z, rad."""
    qpos = torch.from_numpy(character.standing_qpos()).float()[None].repeat(len(angles), 1)
    joint = character.BALL_QPOS[1]
    qpos[:, joint : joint + 4] = rotations.from_rotation_vector(torch.tensor(angles))
    return qpos


def test_a_neck_out_of_its_bounds_tells_no_step_that_nobody_makes() -> None:
    gait, other = Gait(2), torch.full((2, 3), 9.0).double()
    gait.mode[:], gait.time[:] = STEP, 6.0
    told = phase_cue.angles(bent((0.0, 0.7, -0.78), (0.0, -0.6, 0.78)))
    known = phase_cue.read(gait, told.double(), other)
    expected = torch.tensor([[0.5, 9.0, -0.7], [-0.3, 9.0, 0.7]]).double()
    torch.testing.assert_close(known, expected)


def test_the_porter_goes_on_as_the_neck_tells() -> None:
    """Whatever it remembers: with the step's length and turn, and with the first foot."""
    bank, still = BoxBank([box(1.0)]), torch.zeros(1, 34)
    at, ahead = torch.tensor([[2.0, 0.0, 0.8]]), torch.tensor([[1.0, 0.0]])
    place = bank.target(torch.arange(1), resting(at, ahead, at + torch.tensor([3.0, 0.0, 0.0])))
    porter = Porter(1)
    porter.gait.mode[:], porter.gait.time[:], porter._wish[:] = STEP, 6.0, 9.0
    porter.intend(bent((0.0, 0.14, 0.1)), still, place, bank.mass)
    torch.testing.assert_close(porter._wish, torch.tensor([[0.2, 9.0, 0.1]]).double())
    for sway, foot in ((-0.15, 1), (0.15, 0)):
        porter = Porter(1)
        porter.gait.mode[:], porter.gait.time[:], porter.gait.swing[:] = SHIFT, 4.0, 1 - foot
        porter.intend(bent((sway, 0.0, 0.0)), still, place, bank.mass)
        assert porter.gait.swing.item() == foot


def test_the_neck_of_who_stands_comes_back() -> None:
    walk = Walk(1)
    away, ahead = torch.full((1, 3), -9.0), torch.tensor([[1.0, 0.0]])
    start = bent((0.3, 0.3, -0.3))
    walk.scenes.set_down(torch.arange(1), start, torch.zeros(1, 34), away, ahead)
    walk.go(torch.zeros(1, 3), stop=True, steps=45)
    rest = phase_cue.angles(torch.from_numpy(character.standing_qpos())[None])
    assert walk.gait.stands.all()
    off = phase_cue.angles(walk.scenes.qpos) - rest
    assert off.abs().max() < 0.06, "a fifth of where it was"


def test_who_shifts_his_weight_begins_with_the_foot_that_the_neck_tells() -> None:
    """A sway to the left, before the left foot's step, or to the right: once it has had time to be
    told, clearly, and of nobody else."""
    turns = [(sway, 0.0, 0.0) for sway in (-0.15, 0.15, -0.15, 0.02, 0.6, -0.15)]
    qpos = bent(*turns)
    torch.testing.assert_close(phase_cue.angles(qpos), torch.tensor(turns))
    gait = Gait(6)
    gait.mode[:], gait.time[:] = SHIFT, 4.0
    gait.swing[:] = torch.tensor([0, 1, 0, 1, 1, 0])
    gait.time[2], gait.mode[5] = 3.0, STEP
    assert phase_cue.first_foot(gait, phase_cue.angles(qpos)).tolist() == [1, 0, 0, 1, 1, 0]


@pytest.mark.parametrize("walked", [0.0, 0.3])
def test_the_divergent_component_repeats_itself_under_the_pendulum(walked: float) -> None:
    """A point mass that falls over each foot, and is caught where the next one lands, walks on as
    wished; within 15 %, since the pressure moves with the control steps."""
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


def test_a_shift_that_lasts_ends_in_no_fall_ahead_or_back() -> None:
    """Masses whose divergent component is behind, over and before the soles, as inverted pendulums
    ahead and back, and kept from going sideways: the push away from the foot that will lift brings
    them over the soles meanwhile, where it alone would have let them fall 27 cm far."""
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


def feet_at(x: float, y: float, yaw_rad: float) -> Footing:
    """Side by side about this place."""
    heading = unit(torch.tensor([yaw_rad], dtype=torch.float64))
    middle = torch.tensor([[x, y]]).double() + 0.035 * heading
    aside = 0.1 * torch.stack((-heading[:, 1], heading[:, 0]), dim=1)
    soles = torch.stack((middle - aside, middle + aside), dim=1)
    soles = torch.cat((soles, torch.zeros(1, 2, 1).double()), dim=2)
    yaw = torch.full((1, 2), yaw_rad, dtype=torch.float64)
    return Footing(soles, soles, yaw, heading)


def box_at(at: tuple[float, float], target: tuple[float, float]) -> BoxState:
    """The default box, its short edges along x, on a stand of 60 cm."""
    still, level = torch.zeros(1, 3).double(), torch.tensor([[1.0, 0.0, 0.0, 0.0]]).double()
    half = torch.tensor([[0.175, 0.25, 0.15]]).double()
    place, end = (torch.tensor([[x, y, 0.75]]).double() for x, y in (at, target))
    return BoxState(place, level, still, half, place, end)


NO, YES = torch.tensor([False]), torch.tensor([True])


def test_the_nearest_narrow_face_is_chosen_and_kept() -> None:
    crate = box_at((0.0, 0.0), (5.0, 0.0))
    none = torch.tensor([-1])
    for root, face in (((-2.0, 0.0), 0), ((2.0, 0.0), 1), ((0.3, -2.0), 2), ((0.3, 2.0), 3)):
        found = path.choose(torch.tensor([root]).double(), crate, none)
        assert found.item() == face
    # before a wide one that which faces the target is better, but not by what a change takes
    corner = torch.tensor([[0.1, -1.5]]).double()
    assert path.choose(corner, crate, none).item() == 0
    assert path.choose(corner, crate, torch.tensor([2])).item() == 2
    view = path.view(feet_at(-2.0, 0.0, 0.0), unit(torch.zeros(1).double()), crate, none + 1)
    # 20 cm at the least from the middle, and the gap
    torch.testing.assert_close(view.spot, torch.tensor([[-0.36, 0.0]]).double())
    assert view.off_spot_m.item() == pytest.approx(1.64)


def wish(feet: Footing, crate: BoxState, face: int, laden: Tensor, straight: Tensor) -> list[float]:
    view = path.view(feet, feet.heading, crate, torch.tensor([face]))
    return path.wish(view, crate, laden, straight)[0].tolist()


def test_the_way_goes_straight_or_round_the_box() -> None:
    far = box_at((3.0, 0.0), (9.0, 9.0))
    assert wish(feet_at(0.0, 0.0, 0.0), far, 0, NO, NO) == pytest.approx([0.45, 0.0, 0.0])
    # to the face at its back, past it at 0.62 m; more slowly, since one turns by a share of 1.8
    near = box_at((2.0, 0.0), (9.0, 9.0))
    turn = math.asin(0.62 / 2.0)
    ahead = 0.45 * (1.0 - turn / 1.8)
    expected = [ahead, 0.0, turn * (1.0 - ahead / 0.9)]
    assert wish(feet_at(0.0, 0.0, 0.0), near, 1, NO, NO) == pytest.approx(expected)
    # before the face, 20 cm short of its place and 5 cm to the right, turned by 0.1
    view = feet_at(2.0 - 0.36 - 0.2, -0.05, 0.1)
    seen = rotations.turn_back(view.heading, torch.tensor([[0.2, 0.05]]).double())[0]
    expected = [0.8 * float(seen[0]), 0.7 * float(seen[1]), -0.1]
    assert wish(view, near, 0, NO, YES) == pytest.approx(expected)


@pytest.mark.parametrize("began", [-0.3, 0.3])
@pytest.mark.parametrize("aside", [-0.1, 0.1])
def test_who_has_begun_to_turn_goes_round_a_stand_on_that_side(began: float, aside: float) -> None:
    """With a target right behind it, whichever side the straight way is a little nearer to."""
    crate = box_at((0.7, 0.0), (4.0, aside))
    turn = wish(feet_at(0.0, 0.0, began), crate, 0, YES, NO)[2]
    assert math.copysign(1.0, turn) == math.copysign(1.0, began) and abs(turn) > 0.2
    # a target well to the other side is worth turning back for
    crate = box_at((0.7, 0.0), (4.0, -math.copysign(2.0, began)))
    assert wish(feet_at(0.0, 0.0, began), crate, 0, YES, NO)[2] * began < 0.0


def test_with_the_box_one_leaves_its_stand_backwards_and_stops_before_the_target() -> None:
    crate = box_at((0.4, 0.0), (0.4, 3.0))
    assert wish(feet_at(0.0, 0.0, 0.0), crate, 0, YES, NO) == pytest.approx([-0.24, 0.0, 0.0])
    # 1.25 m off sideways: a box 25 cm deep that way is put down from 44 cm before
    there = feet_at(0.4, 3.0 - 0.25 - 0.19 - 0.03, math.pi / 2)
    view = path.view(there, there.heading, crate, torch.tensor([0]))
    assert view.left_m.item() == pytest.approx(0.03)
    assert path.arrived(view, YES, NO).item() and path.at_target(view).item()
    beyond = feet_at(0.4, 3.0 - 0.25 - 0.19 - 0.14, math.pi / 2)
    view = path.view(beyond, beyond.heading, crate, torch.tensor([0]))
    assert not path.arrived(view, YES, NO).item()
    assert path.arrived(view, YES, YES).item(), "who has stopped does not go on for that"


def test_it_carries_boxes_to_their_targets() -> None:
    """Default, small and heavy boxes (11 kg), in eight scenes each: it is no master."""
    each, u = 8, torch.rand(24, 4, generator=torch.Generator().manual_seed(2))
    scale = [1.0] * each + [0.6] * each + [1.4] * each
    n = len(scale)
    bank = BoxBank([box(one) for one in scale])
    scenes, ids = Scenes(bank.models, 0.35, 3.0), torch.arange(n)
    away, yaw = 1.2 + 0.8 * u[:, 0], math.pi * (2.0 * u[:, 1] - 1.0)
    way, stand = math.pi * (2.0 * u[:, 2] - 1.0), 0.4 + 0.4 * u[:, 3]
    at = torch.stack((away, torch.zeros(n), bank.half[:, 2] + stand), dim=1)
    target = torch.cat((at[:, :2] + 2.0 * unit(way), bank.half[:, 2:] + 0.6), dim=1)
    layout = resting(at, unit(yaw), target)
    standing = torch.from_numpy(character.standing_qpos()).float()[None].repeat(n, 1)
    scenes.set_down(ids, standing, torch.zeros(n, 34), layout.start, layout.start_yaw)
    bank.put(scenes, ids, ids, layout)
    place, task, porter = bank.target(ids, layout), Carry(), Porter(n)
    fell, lasted = torch.zeros(n, dtype=torch.bool), torch.zeros(n)
    seen, lifted = torch.zeros(n, 4, dtype=torch.bool), torch.zeros(n, dtype=torch.bool)
    for _ in range(750):
        scenes.drive(porter.act(scenes.qpos, scenes.qvel, scenes.now(place), bank.mass))
        now, body = scenes.now(place), scenes.body()
        fell |= task.fell(body, now)
        seen[ids, porter.phase] = True
        near = (task.error_m(body, now) < task.success_m) & ~fell
        lasted = torch.where(near, lasted + 1, torch.where(lasted < 30, 0, lasted))
        lifted |= task.stage(body, now)[:, 2] & ~fell
        if (lasted >= 30).sum() >= n // 2 and lifted[2 * each :].sum() >= 2:
            break
    assert lifted[2 * each :].sum() >= 2, "heavy ones come off their stands, in both hands"
    assert (lasted >= 30).sum() >= n // 2, "half of all stay at their targets for a second"
    assert seen[lasted >= 30, : Phase.PUT_DOWN].all(), "by way of the phases before the last"


def test_who_grips_reckons_with_the_load_on_its_stand_already() -> None:
    """Hands on the boxes, these on their stands: the mass to be balanced is body and box."""
    bank = BoxBank([box(0.6), box(0.8)])
    scenes, ids, still = Scenes(bank.models, 0.35, 3.0), torch.arange(2), torch.zeros(2, 34)
    ahead = torch.tensor([[1.0, 0.0]]).repeat(2, 1)
    qpos = torch.from_numpy(character.standing_qpos()).float()[None].repeat(2, 1)
    at = grasp.before(qpos[:, :3], ahead, bank.half[:, 0])
    layout = resting(at, ahead, at + torch.tensor([3.0, 0.0, 0.0]))
    held = bank.target(ids, layout).box
    assert held is not None and grasp.is_at_start(held).all()
    away = torch.full((2, 3), -9.0)
    for state, load_kg in ((qpos, torch.zeros(2)), (grasp.holding(qpos, held), bank.mass)):
        scenes.set_down(ids, state, still, away, ahead)
        bank.put(scenes, ids, ids, layout)
        porter = Porter(2)
        porter.phase[:] = Phase.PICK_UP
        place = scenes.now(bank.target(ids, layout))
        intent = porter.intend(scenes.qpos, scenes.qvel, place, bank.mass)
        borne = (intent.mass.mass_kg - BODY_KG).float()
        torch.testing.assert_close(borne, load_kg, atol=1e-4, rtol=0.0)


def test_hands_hold_high_but_below_the_edge() -> None:
    """Half of the half height up, and at least 6 cm below the edge; in the middle of flat boxes."""
    crate = box_at((0.4, 0.0), (3.0, 0.0))
    figure = Figure.of(torch.from_numpy(character.standing_qpos())[None], torch.zeros(1, 34))
    for half_m, expected in ((0.2, 0.1), (0.08, 0.02), (0.05, 0.0)):
        flat = replace(crate, half=torch.tensor([[0.175, 0.25, half_m]]).double())
        reach = handling.reach(figure, flat, torch.ones(1).double(), NO)
        up = reach.goal[0, :, 2] - flat.position[0, 2]
        torch.testing.assert_close(up, torch.full((2,), expected).double())


def test_a_porter_begins_anew_in_one_scene_alone() -> None:
    porter = Porter(3)
    porter.phase[:] = Phase.PUT_DOWN
    porter.gait.mode[:] = 2
    porter.reset(torch.tensor([0, 2]), torch.tensor([False, True]))
    assert porter.phase.tolist() == [Phase.APPROACH, Phase.PUT_DOWN, Phase.CARRY]
    assert porter.gait.stands.tolist() == [True, False, True]
