"""The walker with a box in hand: where it is led, whose arms it has, and that it carries."""

import math

import numpy as np
import pytest
import torch
from torch import Tensor

from console.run import assembly
from policy.model.acting import Policy
from tests.support.paths import ROOT
from world.character import features
from world.character import model as character
from world.character.model import ARM_CONTROLS
from world.config import CarryConfig, InitialStates, WorldConfig
from world.episodes.shard import Shard
from world.motions.clip import Clip
from world.motions.library import MotionLibrary
from world.motions.synthetic.carries import carrying
from world.motions.synthetic.library import walking
from world.motions.uses.box import BOX
from world.objects.box_bank import BoxBank, boxes
from world.scene.target import BoxState
from world.tasks.carry import grips
from world.teachers.carrying import CarryingWalker, carrying_walker, to_target

N = 32
CONFIG = WorldConfig(
    task="carry",
    initial=InitialStates(0, 1, 0, standing_fraction=1.0),
    carry=CarryConfig(in_hand=1.0, sizes=8, scale=(0.6, 0.9), target_m=(3.0, 5.0), near_target=0.0),
    episode_s=20.0,
    early_pelvis_m=0.4,
)


@pytest.fixture(scope="module")
def clips() -> list[Clip]:
    generator = np.random.default_rng(0)
    carried = carrying(generator, (0.24, 0.34, 0.2), (0.5, 0.6), 1.5, 0.6)
    return [carried, walking(generator, 1.0)]


def made(clips: list[Clip]) -> Shard:
    return Shard(CONFIG, MotionLibrary(clips, use=BOX), BoxBank(boxes(CONFIG.carry)), range(N), 3)


def test_arms_are_those_of_the_box_and_the_rest_is_the_walker_s(clips: list[Clip]) -> None:
    """A walker that tells 0.1 everywhere; it never sees where the arms are."""
    seen: list[Tensor] = []

    def act(state: Tensor, _goal: Tensor) -> Tensor:
        seen.append(state.clone())
        return torch.full((len(state), character.NU), 0.1)

    usual = torch.arange(float(features.STATE.width))
    bank = BoxBank(boxes(CONFIG.carry))
    teacher = carrying_walker(act, usual, clips, bank)
    assert teacher is not None
    shard = made(clips)
    target = shard._target()
    assert target.box is not None
    label = teacher.label(shard._scenes, shard._scenes.body(), target)
    legs = [k for k in range(character.NU) if k not in ARM_CONTROLS]
    torch.testing.assert_close(label[:, legs], torch.full((N, len(legs)), 0.1))
    assert float((label[:, ARM_CONTROLS] - 0.1).abs().amax(dim=1).min()) > 0.2
    # arms of boxes of one size are the same, of a wider box wider apart
    wide = label[target.box.half[:, 1].argmax(), ARM_CONTROLS]
    slim = label[target.box.half[:, 1].argmin(), ARM_CONTROLS]
    assert float((wide - slim).abs().max()) > 0.05
    hand = features.STATE.slice("position_left_hand")
    assert torch.equal(seen[0][:, hand], usual[hand].expand(N, -1))
    foot = features.STATE.slice("position_left_foot")
    assert not torch.equal(seen[0][:, foot], usual[foot].expand(N, -1))


def test_without_a_clip_that_walks_with_a_box_there_is_no_such_teacher(clips: list[Clip]) -> None:
    bank = BoxBank(boxes(CONFIG.carry))
    usual = torch.zeros(features.STATE.width)
    assert carrying_walker(lambda s, g: s, usual, clips[1:], bank) is None


def led(x: float, y: float, degrees: float, stand: tuple[float, float]) -> tuple[Tensor, Tensor]:
    """From (x, y), looking to `degrees`, with a box 0.4 m ahead that is to go to (5, 0)."""
    qpos = torch.from_numpy(character.standing_qpos()).float()[None].clone()
    half = math.radians(degrees) / 2
    qpos[0, :2] = torch.tensor([x, y])
    qpos[0, 3:7] = torch.tensor([math.cos(half), 0.0, 0.0, math.sin(half)])
    body = features.body(qpos, torch.zeros(1, character.NV))
    at = torch.cat((body.root[:, :2] + 0.4 * body.heading, torch.tensor([[1.1]])), dim=1)
    box = BoxState(
        at,
        torch.tensor([[1.0, 0.0, 0.0, 0.0]]),
        torch.zeros(1, 3),
        torch.full((1, 3), 0.15),
        torch.tensor([[*stand, 0.6]]),
        torch.tensor([[5.0, 0.0, 0.6]]),
    )
    return to_target(body, box)


def test_the_way_with_a_box() -> None:
    """The box is to come over the target, 0.4 m ahead of the root; a walker stops 0.2 m short. A
    stand before the character is stepped back from, one behind it or far off is not."""
    ahead, back = torch.tensor([[1.0, 0.0]]), torch.tensor([[-1.0, 0.0]])
    for stand in ((-3.0, 0.0), (-0.5, 0.0)):
        aim, facing = led(0.0, 0.0, 0.0, stand)
        torch.testing.assert_close(aim, torch.tensor([[4.8, 0.0]]))
        torch.testing.assert_close(facing, ahead)
    aim, facing = led(0.0, 0.0, 180.0, (-0.5, 0.0))
    torch.testing.assert_close(aim, torch.tensor([[0.5, 0.0]]), atol=1e-6, rtol=0)
    torch.testing.assert_close(facing, back, atol=1e-6, rtol=0)
    # 0.1 m to go: 0.1 m beyond, not 0.2
    aim, _ = led(4.5, 0.0, 0.0, (-3.0, 0.0))
    torch.testing.assert_close(aim, torch.tensor([[4.7, 0.0]]))


def carried(clips: list[Clip]) -> tuple[float, float]:
    """Of boxes in hand: share that is still held after 2 s, and how far they have come, m."""
    weights = assembly.trained(ROOT / "pretrained" / "walk").weights
    bank = BoxBank(boxes(CONFIG.carry))
    mean = weights["normaliser.mean"][: features.STATE.width]
    teacher = carrying_walker(Policy(weights), mean, clips, bank)
    assert isinstance(teacher, CarryingWalker)
    shard = made(clips)
    held = torch.ones(N, dtype=torch.bool)
    start = shard._scenes.body().root.clone()
    for _ in range(60):
        target = shard._target()
        assert target.box is not None
        step = shard.step(teacher.label(shard._scenes, shard._scenes.body(), target))
        held[step.end_ids] = False
    body, target = shard._scenes.body(), shard._target()
    assert target.box is not None
    held &= grips(body, target.box)
    return float(held.float().mean()), float((body.root - start)[held].norm(dim=1).mean())


def test_it_carries(clips: list[Clip]) -> None:
    """With the clips of people 81 % of 64 are held after 2 s."""
    share, gone = carried(clips)
    assert share > 0.5
    assert gone > 1.0
