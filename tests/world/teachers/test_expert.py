"""An expert labels what another teacher leaves open, with its own actions."""

from collections.abc import Mapping

import torch
from torch import Tensor

from tests.support.world.standing_clip import standing_clip
from world import tasks
from world.config import CarryConfig, InitialStates, WorldConfig
from world.episodes.shard import Shard
from world.motions.library import MotionLibrary
from world.motions.uses.box import BOX
from world.objects.box_bank import BoxBank, boxes
from world.scene.batch import Scenes
from world.scene.target import Target
from world.teachers.expert import ExpertTeacher

WORLD = WorldConfig(
    task="carry",
    carry=CarryConfig(sizes=2, scale=(0.6, 0.7)),
    initial=InitialStates(0.0, 1.0, 0.0, standing_fraction=1.0),
)
LIBRARY = MotionLibrary([standing_clip()], use=BOX)
CARRY = tasks.make("carry")


class EverySecond:
    """Labels each second scene with 0.5, and counts."""

    def __init__(self) -> None:
        self.calls, self.begun = 0, set[int]()

    def reset(self, rows: Tensor, target: Target) -> None:
        self.begun |= set(rows.tolist())

    def label(self, scenes: Scenes, target: Target, variant: Tensor, clock: int) -> Tensor:
        self.calls += 1
        found = torch.full((scenes.n, 28), torch.nan)
        found[::2] = 0.5
        return found

    def state_dict(self) -> dict[str, Tensor]:
        return {"calls": torch.tensor(self.calls)}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        self.calls = int(state["calls"])


def act(state: Tensor, goal: Tensor) -> Tensor:
    """Actions of what the student sees: all 28 are the tenth of the height of its root, less the
    box's distance ahead, and one is beyond every clip."""
    found = (0.1 * state[:, :1] - 0.1 * goal[:, :1]).expand(-1, 28).clone()
    found[:, 3] = 50.0
    return found


def shard(teacher: ExpertTeacher) -> Shard:
    return Shard(WORLD, LIBRARY, BoxBank(boxes(WORLD.carry)), range(5), 3, teacher)


def test_open_states_have_the_experts_own_actions() -> None:
    first = EverySecond()
    scenes = shard(ExpertTeacher(act, CARRY, first))
    assert first.begun == set(range(5))
    for step in range(1, 4):
        state, goal = (part.clone() for part in scenes.observe())
        found = scenes.label()
        assert found is not None and first.calls == step
        assert torch.equal(found[::2], torch.full((3, 28), 0.5))
        # the same set-points: an action beyond a joint's range is labelled as that on its end
        points = [scenes._scenes.set_points(action)[1::2] for action in (found, act(state, goal))]
        torch.testing.assert_close(points[0], points[1], atol=1e-5, rtol=0)
        scenes.step(found)
    other = EverySecond()
    ExpertTeacher(act, CARRY, other).load_state_dict(ExpertTeacher(act, CARRY, first).state_dict())
    assert other.calls == 3


def test_alone_it_labels_every_state() -> None:
    found = shard(ExpertTeacher(act, CARRY)).label()
    assert found is not None and bool(found.isfinite().all())
