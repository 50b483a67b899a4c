"""The teacher of carry within a shard: which states it labels, and that shards continue exactly."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor

from world import teachers
from world.character import servos
from world.config import CarryConfig, InitialStates, WorldConfig
from world.episodes.shard import Shard
from world.errors import ChoiceError, ConfigError
from world.motions.library import MotionLibrary
from world.motions.synthetic.carries import carrying
from world.motions.synthetic.library import walking
from world.motions.uses.box import BOX
from world.objects.box_bank import BoxBank, boxes
from world.teachers.scripted.carry import CarryTeacher
from world.teachers.scripted.controller import Phase

#: Half of the standing characters are near the box.
CONFIG = WorldConfig(
    task="carry",
    initial=InitialStates(0, 1, 0, near_m=(0.4, 1.4), standing_fraction=1.0),
    teacher="carry",
    carry=CarryConfig(sizes=12),
)
N = 24


@pytest.fixture(scope="module")
def bank() -> BoxBank:
    return BoxBank(boxes(CONFIG.carry))


@pytest.fixture(scope="module")
def library() -> MotionLibrary:
    generator = np.random.default_rng(0)
    carried = carrying(generator, (0.24, 0.34, 0.2), (0.5, 0.6), 1.5, 0.6)
    return MotionLibrary([carried, walking(generator, 1.0)], use=BOX)


def make(library: MotionLibrary, bank: BoxBank) -> tuple[Shard, CarryTeacher]:
    """A shard and its teacher."""
    teacher = teachers.make(CONFIG, bank, range(N))
    assert isinstance(teacher, CarryTeacher)
    return Shard(CONFIG, library, bank, range(N), 3, teacher), teacher


def standing(shard: Shard) -> Tensor:
    """[n, 28]: actions that keep the pose."""
    return shard._scenes.actions(servos.coordinates(shard._scenes.qpos)).float()


def test_states_near_the_box_and_stalled_ones_are_labelled(
    library: MotionLibrary, bank: BoxBank
) -> None:
    """Each in two of five control steps, with all 28 actions. The student's actions are executed,
    so that the shard steps as one without a teacher does."""
    shard, teacher = make(library, bank)
    plain = Shard(CONFIG, library, bank, range(N), 3)
    stand = standing(shard)
    found = []
    for _ in range(40):
        step, other = shard.step(stand), plain.step(stand)
        assert torch.equal(step.reward, other.reward) and other.teacher_action is None
        assert step.teacher_action is not None
        found.append(~step.teacher_action.isnan())
    labelled = torch.stack(found)
    assert torch.equal(labelled.all(dim=2), labelled.any(dim=2))
    share = labelled.any(dim=2).float().unflatten(0, (8, 5)).mean(dim=1)
    controller = teacher.controller
    picks_up = controller.phase == Phase.PICK_UP
    now = shard._target().box
    assert now is not None
    near = (now.position - shard._scenes.qpos[:, :3].float())[:, :2].norm(dim=1) < 1.2
    torch.testing.assert_close(share[0], 0.4 * near.float())
    useful = near | picks_up | controller.gait.stalled
    torch.testing.assert_close(share[-1], 0.4 * useful.float())
    assert 2 < picks_up.sum() < near.sum() < N == (share[-1] > 0.0).sum()


def test_a_shard_continues_with_the_same_labels(library: MotionLibrary, bank: BoxBank) -> None:
    shard, _ = make(library, bank)
    stand = standing(shard)
    for _ in range(20):
        shard.step(stand)
    other, _ = make(library, bank)
    other.load_state_dict(shard.state_dict())
    labels = 0
    for _ in range(5):
        one, same = shard.step(stand).teacher_action, other.step(stand).teacher_action
        assert one is not None and same is not None
        assert torch.equal(one.nan_to_num(9.0), same.nan_to_num(9.0))
        labels += int((~one.isnan()).any(dim=1).sum())
    assert labels > N


#: Today's name of the teacher's state by that in shards of older checkpoints.
OLD = {
    "phase": "phase", "_age": "age", "_face": "face", "_straight": "straight", "_halts": "halts",
    "_wish": "step_command", "_yaw_rad": "yaw_rad", "_spin": "spin", "_velocity": "velocity",
    "gait_mode": "gait_mode", "gait_swing": "gait_swing", "gait_time": "gait_time",
    "gait_balks": "gait_stalled", "gait__flew": "gait_flew", "gait__lifted": "gait_lifted",
    "gait__lifted_yaw": "gait_lifted_yaw", "gait__goal": "gait_goal",
}  # fmt: skip


def test_older_checkpoints_load(library: MotionLibrary, bank: BoxBank) -> None:
    shard, teacher = make(library, bank)
    stand = standing(shard)
    for _ in range(20):
        shard.step(stand)
    state = shard.state_dict()
    old = {name: value for name, value in state.items() if not name.startswith("teacher_")}
    old |= {f"porter_{name}": state[f"teacher_{today}"] for name, today in OLD.items()}
    assert len(old) == len(state)
    other, same = make(library, bank)
    other.load_state_dict(old)
    for name, value in teacher.state_dict().items():
        assert torch.equal(same.state_dict()[name], value), name


def test_unknown_teachers_and_other_tasks_are_refused(bank: BoxBank) -> None:
    assert teachers.make(replace(CONFIG, teacher=None), bank, range(4)) is None
    with pytest.raises(ChoiceError, match=r"unknown --world\.teacher 'crab': choose one of carry"):
        teachers.make(replace(CONFIG, teacher="crab"), bank, range(4))
    with pytest.raises(ConfigError, match=r"--world\.teacher carry does not teach the task sit"):
        teachers.check(replace(CONFIG, task="sit"))
