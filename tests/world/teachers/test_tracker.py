"""A tracking policy as a teacher: its labels drive scenes that hide the reference as its own
actions drive scenes that show it."""

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from console.run import assembly
from policy.model.acting import Policy
from tests.support.paths import ROOT
from tests.support.track_scenes import WORLD, bank, motions
from world.character import model as character
from world.character.features import STATE
from world.episodes.shard import Shard
from world.tasks.track import Track
from world.teachers import tracker
from world.teachers.teacher import UNTAUGHT
from world.teachers.tracker import TrackerTeacher

N = 16


def act(state: Tensor, goal: Tensor) -> Tensor:
    """Small actions that depend on all that a tracker sees."""
    assert state.shape[1:] == (STATE.width,) and goal.shape == (len(state), Track.goal.width)
    seen = torch.cat((state, goal), dim=1)
    mixed = torch.linspace(-1.0, 1.0, character.NU * seen.shape[1]).view(-1, seen.shape[1])
    return 0.1 * torch.tanh(seen @ mixed.sin().T)


def shard(residual: bool, teacher: TrackerTeacher | None = None) -> Shard:
    world = replace(WORLD, track=replace(WORLD.track, residual=residual))
    return Shard(world, motions(), bank(), range(N), 5, teacher)


@pytest.mark.parametrize("residual", [True, False])
def test_labels_move_a_student_without_reference_as_the_tracker_moves_itself(
    residual: bool,
) -> None:
    tracking, taught = shard(residual), shard(False, TrackerTeacher(act, residual))
    for _ in range(6):
        own = act(*tracking.observe())
        label = taught.label()
        assert label is not None and label.dtype == torch.float32
        a, b = tracking.step(own), taught.step(label)
        assert b.teacher_action is not None and torch.equal(b.teacher_action, label)
        torch.testing.assert_close(a.reward, b.reward, atol=2e-4, rtol=0)
        assert torch.equal(a.end_ids, b.end_ids)
    torch.testing.assert_close(tracking._scenes.qpos, taught._scenes.qpos, atol=1e-4, rtol=0)


def test_labels_do_not_depend_on_how_many_rows_are_labelled_at_a_time() -> None:
    """How many scenes need a label is a matter of the shard's size: of the number of workers."""
    policy = Policy(assembly.trained(ROOT / "pretrained" / "track-sit").weights)
    random = torch.Generator().manual_seed(0)
    state = torch.randn(40, STATE.width, generator=random)
    goal = torch.randn(40, Track.goal.width, generator=random)

    def act(rows: slice) -> Tensor:
        return policy(tracker.whole(state[rows]), tracker.whole(goal[rows]))

    every = act(slice(0, 40))
    assert every.shape[0] == 64
    for rows in (slice(0, 1), slice(5, 7), slice(7, 10), slice(0, 32), slice(3, 39)):
        assert torch.equal(act(rows)[: rows.stop - rows.start], every[rows])
    assert torch.equal(tracker.whole(state[:32]), state[:32])


def test_a_teacher_whose_labels_count_nothing_is_not_asked() -> None:
    asked = []

    def counted(state: Tensor, goal: Tensor) -> Tensor:
        asked.append(len(state))
        return act(state, goal)

    one = shard(False, TrackerTeacher(counted, True))
    one.step(torch.zeros(N, character.NU))
    assert len(asked) == 1
    one.update_sampling({UNTAUGHT: torch.ones(1)})
    found = one.step(torch.zeros(N, character.NU))
    assert found.teacher_action is None and one.label() is None and len(asked) == 1
    one.update_sampling({"failures": torch.zeros(3)})
    assert one.label() is not None and len(asked) == 2


def test_a_teacher_keeps_nothing() -> None:
    one = shard(False, TrackerTeacher(act, True))
    assert not any(name.startswith("teacher_") for name in one.state_dict())
