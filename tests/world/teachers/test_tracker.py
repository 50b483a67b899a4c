"""A tracking policy as a teacher: its labels drive scenes that hide the reference as its own
actions drive scenes that show it."""

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from tests.support.track_scenes import WORLD, bank, motions
from world.character import model as character
from world.character.features import STATE
from world.episodes.shard import Shard
from world.tasks.track import Track
from world.teachers.tracker import TrackerTeacher

N = 16


def act(state: Tensor, goal: Tensor) -> Tensor:
    """Small actions that depend on all that a tracker sees."""
    assert state.shape == (N, STATE.width) and goal.shape == (N, Track.goal.width)
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


def test_a_teacher_keeps_nothing() -> None:
    one = shard(False, TrackerTeacher(act, True))
    assert not any(name.startswith("teacher_") for name in one.state_dict())
