"""The scripted controller: boxes that it picks up, carries and puts down, in the physics."""

import math

import pytest
import torch

from tests.support.walking import bent
from world.character import model as character
from world.objects import grasp
from world.objects.box_bank import BoxBank, resting
from world.scene.batch import Scenes
from world.scene.box import box
from world.tasks.carry import Carry
from world.teachers.scripted.controller import CarryController, Phase
from world.teachers.scripted.gait import SHIFT, STEP, unit
from world.teachers.scripted.whole_body import BODY_KG


@pytest.fixture(autouse=True)
def one_thread() -> None:
    torch.set_num_threads(1)


def test_the_controller_takes_step_and_first_foot_from_the_neck() -> None:
    bank, still = BoxBank([box(1.0)]), torch.zeros(1, 34)
    at, ahead = torch.tensor([[2.0, 0.0, 0.8]]), torch.tensor([[1.0, 0.0]])
    place = bank.target(torch.arange(1), resting(at, ahead, at + torch.tensor([3.0, 0.0, 0.0])))
    controller = CarryController(1)
    controller.gait.mode[:], controller.gait.time[:], controller._step_command[:] = STEP, 6.0, 9.0
    controller.intend(bent((0.0, 0.14, 0.1)), still, place, bank.mass)
    torch.testing.assert_close(controller._step_command, torch.tensor([[0.2, 9.0, 0.1]]).double())
    for sway, foot in ((-0.15, 1), (0.15, 0)):
        controller = CarryController(1)
        gait = controller.gait
        gait.mode[:], gait.time[:], gait.swing[:] = SHIFT, 4.0, 1 - foot
        controller.intend(bent((sway, 0.0, 0.0)), still, place, bank.mass)
        assert gait.swing.item() == foot


def test_it_carries_boxes_to_their_targets() -> None:
    """Default, small and heavy boxes (11 kg), in eight scenes each; half of all arrive."""
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
    scenes.set_state(ids, standing, torch.zeros(n, 34), layout.start, layout.start_yaw)
    bank.apply(scenes, ids, ids, layout)
    place, task, controller = bank.target(ids, layout), Carry(), CarryController(n)
    fell, lasted = torch.zeros(n, dtype=torch.bool), torch.zeros(n)
    seen, lifted = torch.zeros(n, 4, dtype=torch.bool), torch.zeros(n, dtype=torch.bool)
    for _ in range(750):
        scenes.drive(controller.set_points(scenes.qpos, scenes.qvel, scenes.now(place), bank.mass))
        now, body = scenes.now(place), scenes.body()
        fell |= task.fell(body, now)
        seen[ids, controller.phase] = True
        near = (task.error_m(body, now) < task.success_m) & ~fell
        lasted = torch.where(near, lasted + 1, torch.where(lasted < 30, 0, lasted))
        lifted |= task.stage(body, now)[:, 2] & ~fell
        if (lasted >= 30).sum() >= n // 2 and lifted[2 * each :].sum() >= 2:
            break
    assert lifted[2 * each :].sum() >= 2, "heavy boxes come off their stands, in both hands"
    assert (lasted >= 30).sum() >= n // 2, "half of all boxes stay at their targets for a second"
    assert seen[lasted >= 30, : Phase.PUT_DOWN].all(), "through the phases before the last"


def test_gripping_hands_add_the_load_to_the_balance() -> None:
    """With hands on boxes that are still on their stands, the supported mass is body and box."""
    bank = BoxBank([box(0.6), box(0.8)])
    scenes, ids, still = Scenes(bank.models, 0.35, 3.0), torch.arange(2), torch.zeros(2, 34)
    ahead = torch.tensor([[1.0, 0.0]]).repeat(2, 1)
    qpos = torch.from_numpy(character.standing_qpos()).float()[None].repeat(2, 1)
    at = grasp.held_centre(qpos[:, :3], ahead, bank.half[:, 0])
    layout = resting(at, ahead, at + torch.tensor([3.0, 0.0, 0.0]))
    held = bank.target(ids, layout).box
    assert held is not None and grasp.is_at_start(held).all()
    away = torch.full((2, 3), -9.0)
    for state, load_kg in ((qpos, torch.zeros(2)), (grasp.holding_pose(qpos, held), bank.mass)):
        scenes.set_state(ids, state, still, away, ahead)
        bank.apply(scenes, ids, ids, layout)
        controller = CarryController(2)
        controller.phase[:] = Phase.PICK_UP
        place = scenes.now(bank.target(ids, layout))
        intent = controller.intend(scenes.qpos, scenes.qvel, place, bank.mass)
        borne = (intent.mass.mass_kg - BODY_KG).float()
        torch.testing.assert_close(borne, load_kg, atol=1e-4, rtol=0.0)


def test_a_reset_changes_only_its_scenes() -> None:
    controller = CarryController(3)
    controller.phase[:] = Phase.PUT_DOWN
    controller.gait.mode[:] = 2
    controller.reset(torch.tensor([0, 2]), torch.tensor([False, True]))
    assert controller.phase.tolist() == [Phase.APPROACH, Phase.PUT_DOWN, Phase.CARRY]
    assert controller.gait.standing.tolist() == [True, False, True]
