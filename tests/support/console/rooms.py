"""Rooms of the demo, with the committed policies."""

from functools import cache

import pretrained
from console.demo.layout import furnished
from console.demo.room import Room
from console.serving import loading
from policy.checkpoints.served import Served


@cache
def policies() -> dict[str, Served]:
    return {name: loading.served(name, pretrained.ROOT / name) for name in pretrained.names()}


def room(seed: int = 0) -> Room:
    return Room(policies(), furnished(seed), seed)


def run(room: Room, steps: int) -> int:
    """Step until the goal is reached; the number of steps, `steps` where it is not."""
    for step in range(steps):
        if room.done:
            return step
        room.step()
    return steps
