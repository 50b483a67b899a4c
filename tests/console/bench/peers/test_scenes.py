"""Our scenes as a peer's environment, against the rollout of the same scenes and actions."""

import numpy as np
import pytest
import torch

from actors.worker import ShardLike, Worker
from console.bench.peers.scenes import (
    NextStep,
    ProcessScenes,
    Scenes,
    ScenesError,
    ShardScenes,
    Transition,
)
from console.run import assembly
from policy.model.acting import publish
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser
from policy.rollout import Rollout, successors
from tests.support.faulty_shard import MakePoints
from tests.support.point_shard import ACTION, GOAL, STATE, PointShard
from world.character.model import NU
from world.config import WorldConfig

SCENES, STEPS, SEED = 8, 60, 5
WIDTH = STATE + GOAL
POINTS = range(SCENES)


def points(broken: tuple[int, int] | None = None) -> PointShard:
    return PointShard(POINTS, SEED, broken)


def rollout_of(shard: ShardLike, scenes: range, steps: int, widths: tuple[int, int]) -> Rollout:
    torch.manual_seed(0)
    weights = publish(Actor(widths[0], widths[1], (8,)), Normaliser(widths[0]))
    return Worker(shard, scenes, 3, len(scenes)).rollout(weights, 0, steps, 1.5)


def played(scenes: Scenes, rollout: Rollout) -> list[Transition]:
    return [scenes.step(actions) for actions in rollout.actions]


def check_equal(found: list[Transition], rollout: Rollout) -> None:
    """Transitions are those of the rollout, where its samples are valid."""
    raw = torch.cat((rollout.states, rollout.goals), -1)
    ends = torch.cat((rollout.end_states, rollout.end_goals), -1)
    valid = rollout.valid
    assert torch.equal(torch.stack([t.observation for t in found]), raw[1:])
    reward = torch.stack([t.reward for t in found])
    assert torch.equal(reward[valid], rollout.rewards[valid]) and not reward[~valid].any()
    assert torch.equal(torch.stack([t.terminated for t in found]), rollout.fell | ~valid)
    assert torch.equal(torch.stack([t.truncated for t in found]), rollout.timed_out & valid)
    true = successors(raw, rollout.end_index, ends)
    assert torch.equal(torch.stack([t.successor for t in found])[valid], true[valid])


def test_transitions_are_those_of_the_rollout() -> None:
    rollout = rollout_of(points(), POINTS, STEPS, (WIDTH, ACTION))
    assert rollout.fell.any() and rollout.timed_out.any(), "both ends occur"
    scenes = ShardScenes(points())
    first = torch.cat((rollout.states[0], rollout.goals[0]), -1)
    assert torch.equal(scenes.observation, first)
    check_equal(played(scenes, rollout), rollout)


def test_a_non_finite_scene_ends_without_a_reward() -> None:
    """A peer has no samples that are dropped: the scene ends where it last was finite."""
    rollout = rollout_of(points((4, 2)), POINTS, 6, (WIDTH, ACTION))
    assert not rollout.valid[3, 2] and rollout.valid.sum() == 6 * SCENES - 1
    found = played(ShardScenes(points((4, 2))), rollout)
    check_equal(found, rollout)
    last = torch.cat((rollout.states[3, 2], rollout.goals[3, 2]))
    assert torch.equal(found[3].successor[2], last) and found[3].terminated[2]


def test_sit_scenes_are_those_of_the_rollout() -> None:
    """On the real world; a wild policy falls within these steps."""
    world, scenes = WorldConfig(pieces=4, scales=1), range(32)

    def shard() -> ShardLike:
        return assembly.shard(world, scenes, 0)

    state, goal = (part.shape[1] for part in shard().observe())
    rollout = rollout_of(shard(), scenes, 12, (state + goal, NU))
    assert len(rollout.end_index) > 0
    check_equal(played(ShardScenes(shard()), rollout), rollout)


@pytest.fixture
def in_processes() -> ProcessScenes:
    scenes = ProcessScenes(MakePoints(SEED), SCENES, WIDTH, 2, 4, ACTION)
    yield scenes
    scenes.close()


def test_processes_step_the_same_scenes(in_processes: ProcessScenes) -> None:
    rollout = rollout_of(points(), POINTS, STEPS, (WIDTH, ACTION))
    before = in_processes.observation
    found = played(in_processes, rollout)
    check_equal(found, rollout)
    first = torch.cat((rollout.states[0], rollout.goals[0]), -1)
    assert torch.equal(before, first), "a result stays as it is while the scenes go on"


def test_an_error_in_a_worker_is_raised() -> None:
    scenes = ProcessScenes(MakePoints(SEED, "raise", 2), SCENES, WIDTH, 1, 4, ACTION)
    actions = torch.zeros(SCENES, ACTION)
    scenes.step(actions)
    with pytest.raises(ScenesError, match="ArithmeticError: the seat fell"):
        scenes.step(actions)
    scenes.close()


class Script:
    """Scenes that do as they are told: [steps, n] ends, observations that count the steps."""

    def __init__(self, terminated: list[list[int]], truncated: list[list[int]]) -> None:
        self.ends = zip(
            torch.tensor(terminated).bool(), torch.tensor(truncated).bool(), strict=True
        )
        self.clock = 0
        self.given: list[torch.Tensor] = []

    @property
    def observation(self) -> torch.Tensor:
        return torch.full((2, 1), float(self.clock))

    def step(self, actions: torch.Tensor) -> Transition:
        self.clock += 1
        self.given.append(actions)
        terminated, truncated = next(self.ends)
        ended = (terminated | truncated)[:, None]
        last = torch.where(ended, self.observation + 0.5, self.observation)
        return Transition(self.observation, torch.ones(2), terminated, truncated, last)


def test_the_step_after_an_end_is_a_reset() -> None:
    """Gymnasium's NEXT_STEP: last observation and end, then the first one, reward 0 and no end."""
    scenes = NextStep(Script([[1, 0], [1, 0], [0, 0]], [[0, 0], [0, 0], [0, 1]]))
    assert scenes.reset().tolist() == [[0.0], [0.0]]
    actions = np.ones((2, 1), np.float32)
    seen, reward, terminated, truncated = scenes.step(actions)
    assert seen.tolist() == [[1.5], [1.0]] and reward.tolist() == [1.0, 1.0]
    assert terminated.tolist() == [True, False] and not truncated.any()
    seen, reward, terminated, truncated = scenes.step(actions)
    assert seen.tolist() == [[2.0], [2.0]] and reward.tolist() == [0.0, 1.0]
    assert not terminated.any(), "an end in the step of a reset is not seen"
    seen, reward, terminated, truncated = scenes.step(actions)
    assert seen.tolist() == [[3.0], [3.5]] and reward.tolist() == [1.0, 1.0]
    assert truncated.tolist() == [False, True] and not terminated.any()


def test_a_reset_is_stepped_with_action_0() -> None:
    script = Script([[1, 0], [0, 0]], [[0, 0], [0, 0]])
    scenes = NextStep(script)
    for _ in range(2):
        scenes.step(np.ones((2, 1), np.float32))
    assert script.given[1].tolist() == [[0.0], [1.0]]
