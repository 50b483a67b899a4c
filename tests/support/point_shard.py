"""A shard with dynamics that can be checked on paper: points that must move to a target."""

from dataclasses import dataclass

import torch
from torch import Tensor

from policy.rollout import Rollout
from world.random_streams import uniform

STATE, GOAL, ACTION = 4, 2, 2
STRIDE = 0.1
LIMIT = 25
EDGE = 1.6


@dataclass
class PointStep:
    reward: Tensor
    fell: Tensor
    timed_out: Tensor
    finite: Tensor
    end_ids: Tensor
    end_states: Tensor
    end_goals: Tensor
    terms: Tensor
    episodes: dict[str, Tensor]
    teacher_action: Tensor | None = None


class PointShard:
    """x' = x + 0.1 clip(a, ±3); reward exp(-|x' - target|²); falls beyond |x'| > 1.6."""

    def __init__(self, scenes: range, seed: int = 0, broken: tuple[int, int] | None = None) -> None:
        self.ids = torch.arange(scenes.start, scenes.stop)
        self.n = len(scenes)
        self.seed = seed
        self.clock = 0
        self.broken = broken
        self.x = torch.zeros(self.n, 2)
        self.target = torch.zeros(self.n, 2)
        self.age = torch.zeros(self.n, dtype=torch.int64)
        self.total = torch.zeros(self.n)
        self.episode = torch.zeros(self.n, dtype=torch.int64)
        self._reset(torch.arange(self.n))

    def _reset(self, rows: Tensor) -> None:
        draw = uniform(self.seed, 2, self.ids[rows], self.episode[rows], 4) * 2 - 1
        self.x[rows], self.target[rows] = draw[:, :2], draw[:, 2:]
        self.age[rows], self.total[rows] = 0, 0.0
        self.episode[rows] += 1

    def observe(self) -> tuple[Tensor, Tensor]:
        constant = torch.ones(self.n, 2)
        return torch.cat((self.x, constant), 1), self.target - self.x

    def step(self, action: Tensor) -> PointStep:
        self.clock += 1
        self.x = self.x + STRIDE * action.clamp(-3, 3)
        self.age = self.age + 1
        error = (self.x - self.target).square().sum(-1)
        reward = torch.exp(-error)
        finite = torch.ones(self.n, dtype=torch.bool)
        if self.broken is not None and self.clock == self.broken[0]:
            finite &= self.ids != self.broken[1]
            reward = torch.where(finite, reward, float("nan"))
        self.total = self.total + reward
        fell = self.x.norm(dim=-1) > EDGE
        timed_out = (self.age >= LIMIT) & ~fell
        ended = (fell | timed_out | ~finite).nonzero().squeeze(-1)
        state, goal = self.observe()
        sound = ended[finite[ended]]
        step = PointStep(
            reward=reward,
            fell=fell,
            timed_out=timed_out,
            finite=finite,
            end_ids=sound,
            end_states=state[sound],
            end_goals=goal[sound],
            terms=torch.stack((reward, error), -1),
            episodes={
                "return": self.total[ended],
                "length": self.age[ended].float(),
                "success": (error[ended] < 0.05).float(),
                "fall": fell[ended].float(),
                "start": (self.episode[ended] % 2).float(),
            },
        )
        self._reset(ended)
        return step

    def state_dict(self) -> dict[str, Tensor]:
        names = ("x", "target", "age", "total", "episode")
        held = {name: getattr(self, name).clone() for name in names}
        return held | {"clock": torch.tensor(self.clock)}

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        for name, value in state.items():
            setattr(self, name, int(value) if name == "clock" else value.clone())


def next_goals(got: Rollout) -> torch.Tensor:
    """Offset to the target after each step, across resets."""
    following = got.goals[1:].clone()
    following[got.end_index[:, 0], got.end_index[:, 1]] = got.end_goals
    return following
