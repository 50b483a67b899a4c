"""Real scenes, one of which is given a velocity that is no number, at one moment of its clock."""

from dataclasses import dataclass
from typing import Any

from console.run.assembly import MakeShard
from world.episodes.shard import Step


@dataclass(frozen=True)
class MakePoisoned:
    """Shards of `sound`; scene `victim` goes NaN in the step that ends at clock `at`."""

    sound: MakeShard
    victim: int = 20
    at: int = 9

    def __call__(self, scenes: range) -> Any:
        shard = self.sound(scenes)
        return (
            Poisoned(shard, scenes.index(self.victim), self.at) if self.victim in scenes else shard
        )


class Poisoned:
    """A shard and its poison; everything else is the shard's."""

    def __init__(self, shard: Any, row: int, at: int) -> None:
        self._inner, self._row, self._at = shard, row, at

    def step(self, action) -> Step:
        if self._inner.clock + 1 == self._at:
            self._inner._shard._scenes.qvel[self._row, 10] = float("nan")
        return self._inner.step(action)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)
