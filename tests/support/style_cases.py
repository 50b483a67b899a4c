"""A small mocap and rollouts for the discriminator's tests, in this process or another."""

import os
import signal
import time
from pathlib import Path

import torch
from torch import Tensor

from discriminator.config import StyleConfig
from discriminator.process import ServiceSpec
from discriminator.trainer import Discriminator

WIDTH = 7
SMALL = StyleConfig(hidden=(32, 16), batch=64, replay=300, normaliser_samples=500, penalty_batch=32)


class Mocap:
    """Gaussian states around 1 that move by 0.1 a step."""

    def sample(self, n: int, counter: int) -> tuple[Tensor, Tensor]:
        draw = torch.Generator().manual_seed(counter)
        states = 1 + 0.5 * torch.randn(n, WIDTH, generator=draw)
        return states, states + 0.1

    def held_out(self, n: int, counter: int) -> tuple[Tensor, Tensor]:
        return self.sample(n, 10_000_000 + counter)


def rollout(seed: int, steps: int = 4, scenes: int = 16) -> dict[str, Tensor]:
    """A rollout around 0 with two ended episodes and one invalid transition."""
    draw = torch.Generator().manual_seed(seed)
    valid = torch.ones(steps, scenes, dtype=torch.bool)
    valid[0, 1] = False
    return {
        "rollout_states": torch.randn(steps + 1, scenes, WIDTH, generator=draw),
        "end_index": torch.tensor([[1, 2], [steps - 1, 0]]),
        "end_states": torch.randn(2, WIDTH, generator=draw),
        "valid": valid,
    }


def assert_equal_states(a: dict[str, Tensor], b: dict[str, Tensor]) -> None:
    assert a.keys() == b.keys()
    for name in a:
        assert torch.equal(a[name], b[name]), name


def make_mocap() -> Mocap:
    """For a service in a process of its own."""
    return Mocap()


class Deadly(Mocap):
    """Kills its process in the middle of the training of version 2, once."""

    def __init__(self, once: str) -> None:
        self.once = Path(once)

    def sample(self, n: int, counter: int) -> tuple[Tensor, Tensor]:
        if counter == 2 * SMALL.steps_per_iteration + 1 and not self.once.exists():
            self.once.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().sample(n, counter)


def make_deadly(once: str) -> Deadly:
    """For a service that dies while it trains."""
    return Deadly(once)


def make_nothing() -> Mocap:
    """A factory that fails as one without clips does."""
    from world.errors import ClipError

    raise ClipError("no clips in nowhere: give --motions")


SPEC = ServiceSpec(mocap="tests.support.style_cases:make_mocap", style=SMALL)


def local() -> Discriminator:
    return Discriminator(SMALL, Mocap(), 0)


def trained(trainings: int = 3) -> Discriminator:
    """A small discriminator after some trainings."""
    style = Discriminator(SMALL, Mocap(), 0)
    for k in range(trainings):
        style.score(k, **rollout(k))
        style.train(k)
    return style


def discriminator(config: StyleConfig = SMALL, seed: int = 0) -> Discriminator:
    return Discriminator(config, Mocap(), seed)


def iterate(style: Discriminator, first: int, last: int) -> list[Tensor]:
    rewards = []
    for k in range(first, last):
        rewards.append(style.score(k, **rollout(k)).reward)
        style.train(k)
    return rewards


def sleep() -> Mocap:
    """A factory that does not come to an end."""
    time.sleep(600)
    return Mocap()
