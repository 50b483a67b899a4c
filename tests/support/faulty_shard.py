"""Point shards that die, hang, raise or lag, once or always, in whatever process."""

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

from tests.support.point_shard import PointShard, PointStep
from world.errors import ConfigError


class FaultyShard(PointShard):
    """Fails when its clock reaches `at`; `once` is a file that keeps it from failing again."""

    def __init__(self, scenes: range, seed: int, fault: str, at: int, once: Path | None) -> None:
        super().__init__(scenes, seed)
        self.fault, self.at, self.once = fault, at, once

    def step(self, action) -> PointStep:
        if self.clock + 1 == self.at and not (self.once and self.once.exists()):
            if self.once:
                self.once.touch()
            match self.fault:
                case "kill":
                    os.kill(os.getpid(), signal.SIGKILL)
                case "stop":
                    os.kill(os.getpid(), signal.SIGSTOP)
                case "hang":
                    time.sleep(600)
                case "raise":
                    raise ArithmeticError("the seat fell through the floor")
        return super().step(action)


class SlowShard(PointShard):
    """Sleeps as long for each scene and step as a machine takes that is so slow."""

    scene_s = 0.0

    def step(self, action) -> PointStep:
        time.sleep(self.scene_s * self.n)
        return super().step(action)


@dataclass(frozen=True)
class MakeSlowPoints:
    """Shards of an actor that takes `scene_s` for a scene and step; the first actor to make one of
    the scene `victim` takes `factor` times as long, for all that it makes from then on."""

    once: Path
    seed: int = 5
    scene_s: float = 0.5e-3
    factor: float = 10.0
    victim: int = 5

    def __call__(self, scenes: range) -> PointShard:
        if self.victim in scenes and not self.once.exists():
            self.once.write_text(str(os.getpid()))
        slow = self.once.exists() and self.once.read_text() == str(os.getpid())
        shard = SlowShard(scenes, self.seed)
        shard.scene_s = self.scene_s * (self.factor if slow else 1.0)
        return shard


@dataclass(frozen=True)
class MakePoints:
    """Sound shards, but for the one that owns `victim`."""

    seed: int = 5
    fault: str = ""
    at: int = 13
    victim: int = 5
    once: Path | None = None

    def __call__(self, scenes: range) -> PointShard:
        if self.fault == "misconfigured":
            raise ConfigError("no such chair: choose one of chair, stool")
        if self.fault and self.victim in scenes:
            return FaultyShard(scenes, self.seed, self.fault, self.at, self.once)
        return PointShard(scenes, self.seed)
