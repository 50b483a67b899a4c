"""The stall time-out ends the episodes in which nothing moves, and no others."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from world.character import servos
from world.character.features import Body
from world.config import CarryConfig, InitialStates, WorldConfig
from world.episodes.shard import Shard
from world.episodes.stall import StallTimeout
from world.errors import ConfigError
from world.motions.library import MotionLibrary
from world.motions.synthetic.library import walking
from world.motions.uses.box import BOX
from world.objects.box_bank import BoxBank, boxes
from world.scene.target import BoxState, Target

CONFIG = WorldConfig(
    task="carry",
    carry=CarryConfig(sizes=8),
    initial=InitialStates(0, 1, 0, standing_fraction=1.0, near_m=(0.8, 1.5)),
)


def body(root_x: list[float]) -> Body:
    n = len(root_x)
    root = torch.tensor([[x, 0.0, 0.9] for x in root_x])
    none, upright = torch.zeros(n, 3), torch.eye(3).repeat(n, 2, 1, 1)
    at = root[:, None].repeat(1, 15, 1)
    return Body(torch.zeros(n, 105), none[:, :2], at, none, none, none, upright)


def place(box_x: list[float]) -> Target:
    n = len(box_x)
    at = torch.tensor([[x, 0.0, 0.8] for x in box_x])
    none, upright = torch.zeros(n, 3), torch.tensor([[1.0, 0.0, 0.0, 0.0]]).repeat(n, 1)
    box = BoxState(at, upright, none, none, at, none)
    return Target(none, none[:, :2], box.corners(), box=box)


def test_an_episode_with_progress_goes_on() -> None:
    """Four of them for 1 s: stands; goes on by 0.3 m every half second; carries; is done."""
    stall = StallTimeout(4, 0.6)
    every, done = torch.arange(4), torch.tensor([False, False, False, True])
    stall.reset(every, body([0.0] * 4), place([2.0] * 4))
    ended = torch.zeros(4, dtype=torch.long)
    for step in range(30):
        half = step // 15
        ends = stall.ends(
            body([0.2, 0.3 * half, 0.0, 0.0]), place([2.05, 2.0, 2.0 + 0.12 * half, 2.0]), done
        )
        ended = torch.where((ended == 0) & ends, step + 1, ended)
    assert ended.tolist() == [18, 0, 0, 0]
    stall.reset(every[:1], body([0.2]), place([2.05]))
    assert not stall.ends(body([0.2] * 4), place([2.05] * 4), done)[0]


def test_a_box_in_hand_must_come_nearer_to_its_target() -> None:
    """Five boxes for 3 s: one comes on at 0.5 m/s; one goes in a circle of 1 m in a second; one is
    lowered by 0.2 m/s, and held after 0.3 m of it; one is swung about the target; one is on its
    stand, while the character walks in the circle."""
    stall = StallTimeout(5, 0.6)
    every, done = torch.arange(5), torch.zeros(5, dtype=torch.bool)
    ended = torch.zeros(5, dtype=torch.long)
    for step in range(90):
        t = step / 30
        x, y = math.cos(2 * math.pi * t) - 1.0, math.sin(2 * math.pi * t)
        where = torch.tensor(
            [
                [2.0 - 0.5 * t, 0.0, 0.4],
                [2.0 + x, y, 0.4],
                [0.0, 0.0, max(0.4 - 0.2 * t, 0.1)],
                [0.15 * (x + 1.0), 0.15 * y, 0.2],
                [5.0, 0.0, 0.0],
            ]
        )
        target = place([0.0] * 5)
        assert target.box is not None
        start, zero = torch.tensor([[5.0, 0.0, 0.0]]).repeat(5, 1), torch.zeros(5, 3)
        box = replace(target.box, position=where, start=start, target=zero)
        seen = replace(target, box=box)
        person = body([2.0 - 0.5 * t, 2.0 + x, 0.0, 0.15 * x, x])
        if step == 0:
            stall.reset(every, person, seen)
        ends = stall.ends(person, seen, done)
        ended = torch.where((ended == 0) & ends, step + 1, ended)
    forward, circle, lowered, swung, approach = ended.tolist()
    assert forward == approach == 0
    # nearer for the first third of the circle at most, then never again: 18 steps without it
    assert 18 < circle < 60
    assert 45 + 10 < lowered < 45 + 19
    assert swung == 19


def test_who_goes_round_the_stand_does_not_stall() -> None:
    """The target is 3 m behind the stand. The character steps back 0.1 m and goes round at 0.55 m
    and 0.4 m/s, the box 0.33 m before it: for the first 1.9 s it brings the box no nearer in a
    straight line. Another one stands."""
    stall = StallTimeout(2, 1.0)
    stall.reset(torch.arange(2), body([-0.45] * 2), place([0.0] * 2))
    ended = torch.zeros(2, dtype=torch.long)
    for step in range(75):
        away = min(0.45 + 0.4 * step / 30, 0.55)
        turned = max(0.4 * step / 30 - 0.1, 0.0) / 0.55
        angle = math.pi - turned
        root = torch.tensor([away * math.cos(angle), away * math.sin(angle), 0.9])
        ahead = torch.tensor([0.0, 0.0, 0.0])
        facing = angle - math.pi / 2 if turned > 0.0 else 0.0
        ahead[:2] = 0.33 * torch.tensor([math.cos(facing), math.sin(facing)])
        person = body([0.0, -0.45])
        person.position[0] = root
        where = torch.stack((root + ahead, torch.tensor([-0.15, 0.0, 0.9])))
        seen = place([0.0, 0.0])
        assert seen.box is not None
        box = replace(
            seen.box, position=where, target=torch.tensor([[3.0, 0.01, 0.9]]).repeat(2, 1)
        )
        ends = stall.ends(person, replace(seen, box=box), torch.zeros(2, dtype=torch.bool))
        ended = torch.where((ended == 0) & ends, step + 1, ended)
    assert ended.tolist() == [0, 31]


def test_standing_still_ends_as_stalled_not_as_a_fall() -> None:
    library = MotionLibrary([walking(np.random.default_rng(0), 1.0)], use=BOX)
    bank = BoxBank(boxes(CONFIG.carry))

    def stand(config: WorldConfig, steps: int) -> dict[str, torch.Tensor]:
        shard = Shard(config, library, bank, range(32), 1)
        holds = shard._scenes.actions(servos.coordinates(shard._scenes.qpos)).float()
        found: dict[str, list[torch.Tensor]] = {"stalled": [], "fall": [], "length": [], "fell": []}
        for _ in range(steps):
            step = shard.step(holds)
            for key in ("stalled", "fall", "length"):
                found[key].append(step.episodes[key])
            found["fell"].append(step.fell[step.end_ids].float())
        return {key: torch.cat(rows) for key, rows in found.items()}

    found = stand(replace(CONFIG, stall_s=0.5), 16)
    stalled = found["stalled"] > 0.0
    assert stalled.sum() > 20
    assert not found["fall"][stalled].any()
    assert found["fell"][stalled].all(), "to the learner both are ends"
    assert not stand(CONFIG, 16)["stalled"].any()


def test_a_time_out_of_less_than_a_step_is_refused() -> None:
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(ConfigError, match="stall-s"):
            StallTimeout(1, wrong)


def test_a_state_with_the_old_name_of_the_stall_clock_is_restored() -> None:
    library = MotionLibrary([walking(np.random.default_rng(0), 1.0)], use=BOX)
    bank = BoxBank(boxes(CONFIG.carry))
    one, other = (Shard(CONFIG, library, bank, range(4), seed) for seed in (1, 2))
    for _ in range(3):
        one.step(torch.zeros(4, 28))
    old = {k.replace("stall_", "patience_"): v for k, v in one.state_dict().items()}
    assert "patience_still" in old
    other.load_state_dict(old)
    for name, value in one.state_dict().items():
        assert torch.equal(other.state_dict()[name].nan_to_num(), value.nan_to_num()), name
