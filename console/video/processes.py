"""Images of recordings, drawn in several processes and joined in order.

Without a GPU most of an image's time is rasterisation, which one context does in part on a single
core: two processes draw twice as many images. Each draws whole images, so that a picture does not
depend on their number.
"""

import itertools
import math
import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from multiprocessing.connection import Connection, wait
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from console.recording.format import Take
from console.video import camera, drawing
from console.video.canvas import Image
from console.video.drawing import Artist, Look
from world.errors import InhabitError
from world.refusals import one_line

#: Images that a process has to draw at a time, and images in memory for each process.
_ASKED, _HELD = 3, 4
#: Longest time for a process to end before it is killed, s.
_JOIN_S = 2.0
#: An offscreen driver without a GPU starts a thread for each core: too many, once for each process.
_ENVIRONMENT = {"LP_NUM_THREADS": "0"}


class DrawingError(InhabitError):
    """A drawing process that failed or died."""


def images(
    takes: Sequence[Take],
    wanted: Sequence[tuple[int, int]],
    look: Look,
    model: mujoco.MjModel | None = None,
    task: str = "",
    processes: int = 2,
) -> Generator[Image]:
    """Yield the images [height, width, 3] of (number of a take, control step), in order.

    The arguments are those of `Artist`. At most seven images for each process are in memory.
    DrawingError where a process fails or dies. All processes end with the iterator.
    """
    shape = (look.height, look.width, 3)
    workers: list[_Worker] = []
    try:
        with _environment(_ENVIRONMENT):
            for index in range(processes):
                workers.append(_Worker(index, shape, (takes, look, model, task)))
        plan = lru_cache(2)(
            lambda number: camera.plan(
                takes[number], drawing.display_model(takes[number], look, model)
            )
        )
        yield from _in_order(workers, wanted, plan)
    finally:
        for worker in workers:
            worker.close()


def _in_order(
    workers: "Sequence[_Worker]",
    wanted: Sequence[tuple[int, int]],
    plan: Callable[[int], camera.Path],
) -> Iterator[Image]:
    """Yield the wanted images: each process that is free gets the next one.

    plan: returns the camera's path over a take, by its number.
    """
    found: dict[int, Image] = {}
    given, by_pipe = 0, {worker.pipe: worker for worker in workers}
    for at in range(len(wanted)):
        while True:
            end = min(len(wanted), at + _HELD * len(workers))
            while given < end and len((free := min(workers, key=_Worker.load)).asked) < _ASKED:
                free.ask(given, *wanted[given], plan)
                given += 1
            busy = [worker.pipe for worker in workers if worker.asked]
            for pipe in wait(busy, 0.0 if at in found else None) if busy else ():
                index, image = by_pipe[pipe].answer()  # pyright: ignore[reportArgumentType]
                found[index] = image
            if at in found:
                break
        yield found.pop(at)


class _Worker:
    """A drawing process, seen from the one that joins the images."""

    def __init__(self, index: int, shape: tuple[int, int, int], of: tuple) -> None:
        # A fork would share the state of the OpenGL driver.
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        #: Indices of the images that it has to draw, in order.
        self.asked: deque[int] = deque()
        self._answered, self._take = 0, -1
        # A pipe takes a millisecond for each image.
        memory = context.RawArray("B", _ASKED * math.prod(shape))
        self._slots = _slots(memory, shape)
        self._process = context.Process(
            target=_serve, args=(theirs, memory, shape, *of), name=f"drawing-{index}", daemon=True
        )
        self._process.start()
        theirs.close()

    def load(self) -> int:
        """Return how many images it has to draw."""
        return len(self.asked)

    def ask(self, index: int, take: int, frame: int, plan: Callable[[int], camera.Path]) -> None:
        """Ask for an image of a take at a control step."""
        path = None if take == self._take else plan(take)
        self._take = take
        self.asked.append(index)
        try:
            self.pipe.send((take, frame, path))
        except OSError:
            raise self._lost() from None

    def answer(self) -> tuple[int, Image]:
        """Return the next image asked for, with its index."""
        try:
            problem = self.pipe.recv()
        except (EOFError, OSError):
            raise self._lost() from None
        if problem:
            raise DrawingError(f"cannot draw: {problem}")
        image = self._slots[self._answered % _ASKED].copy()
        self._answered += 1
        return self.asked.popleft(), image

    def close(self) -> None:
        """End the process, whatever it draws."""
        self.pipe.close()
        self._process.terminate()
        self._process.join(_JOIN_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _lost(self) -> DrawingError:
        self._process.join(_JOIN_S)
        return DrawingError(
            f"a drawing process died, exit code {self._process.exitcode} (killed, out of memory,"
            " or a crash of the OpenGL driver): no file was written"
        )


def _serve(
    pipe: Connection,
    memory: Any,
    shape: tuple[int, int, int],
    takes: Sequence[Take],
    look: Look,
    model: mujoco.MjModel | None,
    task: str,
) -> None:
    """Draw the images that are asked for into the slots of the memory, in turn, until the pipe
    closes; answer each with what went wrong, empty if nothing."""
    # Ctrl-C reaches the whole process group, but the one that joins the images ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    slots, artist = _slots(memory, shape), None
    for count in itertools.count():
        problem = ""
        try:
            take, frame, path = pipe.recv()
        except (EOFError, OSError):
            break
        try:
            artist = artist or Artist(takes, look, model, task)
            slots[count % _ASKED] = artist.image(take, frame, path)
        except Exception as error:
            problem = one_line(error)
        try:
            pipe.send(problem)
        except OSError:
            break
    if artist is not None:
        artist.close()


def _slots(memory: Any, shape: tuple[int, int, int]) -> NDArray[np.uint8]:
    """Return shared memory as images [slots, height, width, 3]."""
    return np.frombuffer(memory, np.uint8).reshape(_ASKED, *shape)


@contextmanager
def _environment(more: Mapping[str, str]) -> Iterator[None]:
    """Set variables, which the user has not set, for the processes that start within."""
    new = {name: value for name, value in more.items() if name not in os.environ}
    os.environ.update(new)
    try:
        yield
    finally:
        for name in new:
            del os.environ[name]
