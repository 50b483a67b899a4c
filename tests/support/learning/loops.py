"""A style and a record for training loops on the point shard, and their flat states."""

from dataclasses import dataclass, field
from pathlib import Path

import torch

from actors.local import LocalFleet
from learner.config import LagConfig, LearnerConfig, LoopConfig
from learner.loop import Loop
from learner.ppo import Learner
from policy.checkpoints.format import Layout
from policy.checkpoints.run_checkpoints import RunCheckpoints
from policy.rollout import Rollout
from tests.support.faulty_shard import MakePoints
from tests.support.point_shard import ACTION, GOAL, STATE
from world.precision import FLOAT32

LAYOUT = Layout("point", (("point", STATE),), (("target", GOAL),), ACTION, (16, 16))


@dataclass
class Scores:
    reward: torch.Tensor
    version: int
    metrics: dict[str, float] = field(default_factory=dict)


class Slowness:
    """A style that likes slow motion: its scale grows with what it has seen and its version."""

    def __init__(self) -> None:
        self.version = 0
        self.seen = torch.zeros((), dtype=torch.float64)

    def score(self, batch, rollout_states, end_index, end_states, valid) -> Scores:
        following = rollout_states[1:].clone()
        following[end_index[:, 0], end_index[:, 1]] = end_states
        speed = (following - rollout_states[:-1]).norm(dim=-1)
        self.seen = self.seen + speed[valid].double().sum()
        return Scores(torch.exp(-speed * (1 + self.version)), self.version)

    def train(self, version: int) -> dict[str, float]:
        self.version = version + 1
        return {"style/seen": float(self.seen)}

    def state_dict(self) -> dict:
        return {"version": self.version, "seen": self.seen}

    def load_state_dict(self, state: dict) -> None:
        self.version, self.seen = state["version"], state["seen"]


@dataclass
class Memory:
    lines: list = field(default_factory=list)

    def record(self, iteration, metrics) -> None:
        self.lines.append((iteration, dict(metrics)))

    def numbers(self) -> list:
        timed = ("rate/", "seconds", "actors/")
        return [(i, {k: v for k, v in m.items() if not k.startswith(timed)}) for i, m in self.lines]


def tensors(state: dict, prefix: str = "") -> dict:
    flat = {}
    for key, value in state.items():
        flat |= (
            tensors(value, f"{prefix}{key}/") if isinstance(value, dict) else {prefix + key: value}
        )
    return flat


SCENES, HORIZON = 32, 8
SAMPLES = SCENES * HORIZON
LEARNING = LearnerConfig(
    hidden=(16, 16), warmup_iterations=1, minibatch=128, sigma=((0.0, 0.3), (3000.0, 0.1))
)


def student() -> Learner:
    return Learner(STATE + GOAL, ACTION, LEARNING, seed=1, precision=FLOAT32)


def points(workers: int = 2) -> LocalFleet:
    return LocalFleet(MakePoints(), SCENES, 8, workers, seed=5, horizon=HORIZON)


class Watched:
    """A fleet that keeps what it was asked with and what it gave."""

    def __init__(self, fleet: LocalFleet) -> None:
        self.fleet = fleet
        self.asked: list[tuple[dict, int, float]] = []
        self.gave: list[Rollout] = []

    def collect(self, weights, version, sigma) -> Rollout:
        self.asked.append((dict(weights), version, sigma))
        self.gave.append(self.fleet.collect(weights, version, sigma))
        return self.gave[-1]

    def __getattr__(self, name: str):
        return getattr(self.fleet, name)


def looped(path: Path, fleet, config: LoopConfig, style=None) -> Loop:
    checkpoints = RunCheckpoints(path, LAYOUT)
    return Loop(student(), fleet, style, Memory(), checkpoints, config, ("reach", "error"))


def overlapped(iterations: int, **settings) -> LoopConfig:
    return LoopConfig(iterations=iterations, lag=LagConfig(overlap=True), **settings)


def assert_same(got: dict, wanted: dict) -> None:
    assert got.keys() == wanted.keys()
    for key, value in wanted.items():
        same = torch.equal(got[key], value) if torch.is_tensor(value) else got[key] == value
        assert same, key
