"""Drawing processes: the same pictures as of one, and none that outlives its film."""

import multiprocessing
import os
import signal
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from console.recording.format import Recording, Take
from console.video import processes, rendering
from console.video.drawing import Artist, Look
from console.video.processes import DrawingError
from tests.support.console.recordings import take

pytestmark = pytest.mark.skipif(
    rendering.choose_gl() is None, reason="nothing draws offscreen here"
)
LOOK = Look(width=64, height=48)


@pytest.fixture(autouse=True)
def gl() -> Iterator[None]:
    rendering.require_gl()
    yield
    assert not drawing(), "no process outlives its film"


def drawing() -> list[Any]:
    return [p for p in multiprocessing.active_children() if p.name.startswith("drawing-")]


def walking(steps: int) -> Take:
    one = take(steps)
    one.qpos[:, 0] = np.linspace(0.0, 1.5, steps)
    return one


def test_two_processes_draw_what_one_draws_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("LP_NUM_THREADS", raising=False)
    takes = [walking(9), take(2), walking(7)]
    wanted = [(number, frame) for number, one in enumerate(takes) for frame in range(len(one))]
    with closing(Artist(takes, LOOK, task="walk")) as artist:
        alone = [artist.image(*one) for one in wanted]
    shared = list(processes.images(takes, wanted, LOOK, task="walk", processes=2))
    np.testing.assert_array_equal(np.stack(shared), np.stack(alone))
    assert "LP_NUM_THREADS" not in os.environ


def test_a_killed_process_is_one_line_and_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rendering, "processes_for", lambda images, threads: threads)
    out, done = tmp_path / "a.mp4", []

    def progress(count: int) -> None:
        done.append(count)
        if count == 1:
            for process in drawing():
                os.kill(process.pid, signal.SIGKILL)

    with pytest.raises(DrawingError, match=r"^a drawing process died, exit code -9 .*file was wr"):
        rendering.write_video(Recording([walking(40)], {}), out, LOOK, progress=progress, threads=2)
    assert done and done[-1] < 40 and not list(tmp_path.iterdir())


def test_an_interrupt_ends_the_processes_which_ignore_it_themselves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rendering, "processes_for", lambda images, threads: threads)
    seen: list[Any] = []

    def progress(count: int) -> None:
        if count == 1:
            seen.extend(drawing())
            for process in seen:
                os.kill(process.pid, signal.SIGINT)
        if count == 20:
            assert all(process.is_alive() for process in seen)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rendering.write_video(
            Recording([walking(40)], {}), tmp_path / "a.mp4", LOOK, progress=progress, threads=1 + 1
        )
    assert len(seen) == 2 and not list(tmp_path.iterdir())


def test_an_error_of_drawing_is_told_in_one_line() -> None:
    images = processes.images([take(2)], [(0, 0), (0, 7)], LOOK, processes=1)
    assert next(images).shape == (48, 64, 3)
    with pytest.raises(DrawingError, match=r"^cannot draw: .*7"):
        next(images)


def test_few_images_are_asked_for_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    """While nobody takes an image, no more are drawn than what may be held."""
    asked: list[int] = []
    ask = processes._Worker.ask

    def counted(self: Any, index: int, *given: Any) -> None:
        asked.append(index)
        ask(self, index, *given)

    monkeypatch.setattr(processes._Worker, "ask", counted)
    wanted = [(0, frame) for frame in range(30)]
    with closing(processes.images([walking(30)], wanted, LOOK, processes=1)) as images:
        for taken in range(1, 12):
            next(images)
            assert len(asked) <= taken + 4
    assert asked == list(range(len(asked)))
