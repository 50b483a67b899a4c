"""Rooms of the demo with the committed policies, and views whose controls are used by their
labels."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from types import SimpleNamespace
from typing import Any

from console.demo import command
from console.demo.layout import furnished
from console.demo.room import Room
from console.play import server
from console.play.browser.view import View
from console.play.session import Session
from policy.checkpoints.served import Served


@cache
def policies() -> dict[str, Served]:
    return command.policies(())


def room(seed: int = 0) -> Room:
    return Room(policies(), furnished(seed), seed)


def run(room: Room, steps: int) -> int:
    """Step until the goal is reached; the number of steps, `steps` where it is not."""
    for step in range(steps):
        if room.done:
            return step
        room.step()
    return steps


class Used(View):
    """A view that remembers what its controls do."""

    def on(self, handle: Any, act: Callable[[Any], None]) -> None:
        found = self.__dict__.setdefault("acts", {})
        found[getattr(handle, "label", getattr(handle, "name", ""))] = (handle, act)
        super().on(handle, act)

    def use(self, label: str, value: Any = None) -> None:
        """Use a control as a person would; errors are raised."""
        handle, act = self.__dict__["acts"][label]
        if value is not None:
            handle.value = value
        with self.session.lock:
            act(SimpleNamespace(target=handle, client=None))


@contextmanager
def used(session: Session) -> Iterator[Used]:
    """A view of a session, whose server ends with the block."""
    page = server.start("127.0.0.1:0")
    try:
        yield Used(page, session, "test", plots=False)
    finally:
        page.stop()
