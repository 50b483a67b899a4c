"""Tables in files are wide enough to be read."""

import io
import itertools
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from rich.console import Console
from rich.table import Table

from console import terminal
from console.terminal import (
    FILE_WIDTH,
    Watch,
    Work,
    answering,
    doing,
    fitted,
    progress,
    screen,
    signs_of_life,
)
from tests.support.paths import ROOT


def test_a_file_is_as_wide_as_it_should_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "20")
    stream = io.StringIO()
    monkeypatch.setattr("sys.stdout", stream)
    table = Table(*(f"column {i} of a wide table" for i in range(5)))
    console = screen()
    assert console.width == FILE_WIDTH
    console.print(table)
    assert "column 4 of a wide table" in stream.getvalue()


def test_text_is_shown_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """rich reads brackets as markup and names between colons as emoji, in lines, cells and
    titles."""
    text = "walk [take 1] [/x] [bold]:smile:"
    table = Table(text, title=text)
    table.add_row(text)
    output = screen()
    output.print(table)
    output.print(text)
    assert capsys.readouterr().out.count(text) == 4


def test_the_remaining_time_is_that_of_the_work_done() -> None:
    work = Work("trials", 100.0, began=10.0)
    assert work.text(20.0) == "trials 0 of 100, to go -"
    work.done = 25.0
    assert work.remaining(40.0) == "1:30"  # 25 in 30 s, so 75 in 90 s
    work.done = 100.0
    assert work.remaining(50.0) == "0:00"


def test_progress_is_told_while_it_lasts() -> None:
    watch = Watch("inhabit evaluate", 0.0)
    with progress("trials", 4) as update:
        update(1)
        assert "inhabit evaluate: working, 2 s, trials 1 of 4, to go" in str(watch.due(2.0))
    assert watch.due(100.0) == "inhabit evaluate: working, 100 s"


def said_at(watch: Watch, seconds: int) -> list[int]:
    """The tenths of a second at which a silent command speaks."""
    return [t for t in range(10 * seconds) if watch.due(t / 10) is not None]


def test_a_silent_command_speaks_within_two_seconds() -> None:
    """Each second, however long; a thread that waits as long for its turn still keeps the 2 s."""
    times = said_at(Watch("x", 0.0), 400)
    assert times[0] == 10 and {b - a for a, b in itertools.pairwise(times)} == {10}


def test_the_age_of_the_process_counts_from_its_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the clock of the process that starts it."""
    code = "import time; from console.terminal import age_s; print(age_s(), time.monotonic())"
    before = time.monotonic()
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, cwd=ROOT
    ) as process:
        after = time.monotonic()
        told, _ = process.communicate()
    age, now = (float(word) for word in told.split())
    tick = 1 / os.sysconf("SC_CLK_TCK")
    assert now - after - tick <= age <= now - before + tick
    monkeypatch.setattr(terminal, "_STAT", Path("/nowhere"))
    assert terminal.age_s() == pytest.approx(time.process_time(), abs=1.0)


def test_it_says_what_it_does() -> None:
    watch = Watch("inhabit train", 0.0)
    steps = iter(["iteration 1", "iteration 2"])
    with doing("starting"):
        assert watch.due(2.0) == "inhabit train: starting, 2 s"
        with doing(lambda: next(steps)):
            assert watch.due(4.0) == "inhabit train: iteration 1, 4 s"
            assert watch.due(6.0) == "inhabit train: iteration 2, 6 s"
        assert watch.due(8.0) == "inhabit train: starting, 8 s"
    assert watch.due(10.0) == "inhabit train: working, 10 s"


def test_output_of_its_own_is_a_sign_of_life() -> None:
    watch = Watch("x", 0.0)
    watch.written(1.5)
    assert watch.due(2.4) is None and watch.due(2.6) == "x: working, 3 s"


def test_streams_are_as_before(capsys: pytest.CaptureFixture[str]) -> None:
    before = sys.stdout.write
    with signs_of_life("x"):
        assert sys.stdout.write != before
        print("words")
    assert sys.stdout.write == before and capsys.readouterr().out == "words\n"


def test_a_service_speaks_until_it_has_written_something(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """An empty text, as libraries write, is no output."""
    due, said = iter(["first", "second"]), threading.Event()

    def line(_watch: Watch, _now: float) -> str | None:
        following = next(due, None)
        if following is None:
            said.set()
        return following

    monkeypatch.setattr(Watch, "due", line)
    with signs_of_life("x", serves=True):
        sys.stderr.write("")
        assert said.wait(60)
        print("ready")
        threads = [t for t in threading.enumerate() if t.name == "signs of life"]
        for thread in threads:
            thread.join(60)
        assert not any(thread.is_alive() for thread in threads)
    assert capfd.readouterr().err == "first\nsecond\n"


def test_the_first_interrupt_is_answered(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    left: list[str] = []
    monkeypatch.setattr(terminal, "leave_soon", lambda: left.append("soon"))
    monkeypatch.setattr(os, "_exit", lambda code: left.append(f"at once, {code}"))
    before = signal.getsignal(signal.SIGINT)
    with answering():
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert left == ["soon"] and "inhabit: stopping" in capfd.readouterr().err
        with pytest.raises(KeyboardInterrupt):  # here the exit is replaced
            signal.raise_signal(signal.SIGINT)
        assert left[1] == "at once, 130"
    assert signal.getsignal(signal.SIGINT) == before


def test_a_sign_of_life_fits_one_row() -> None:
    """A longer one would leave its first rows on the screen when it is replaced."""
    line = "inhabit train: reading furniture and clips, 12 s"
    assert fitted(line, 80) == line
    assert fitted(line, 40) == "reading furniture and clips, 12 s"
    assert fitted(line, 24) == "and clips, 12 s"
    assert all(len(fitted(line, width)) < width for width in range(2, 80))


@pytest.mark.parametrize("width", [40, 100])
def test_progress_fits_the_screen(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    file = io.StringIO()
    console = Console(file=file, width=width, force_terminal=True, color_system=None)
    monkeypatch.setattr(terminal, "screen", lambda: console)
    with terminal.progress("images", 3000) as update:
        update(1200)
    rows = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", file.getvalue()).replace("\r", "\n").split("\n")
    assert any("1200 of 3000, to go" in row for row in rows)
    assert all(len(row) <= width for row in rows)


def test_counted_work_says_what_it_is_and_is_over_when_it_is_done() -> None:
    watch, tries = Watch("x", 0.0), iter(["try 1", "try 2"])
    with doing("starting"), progress("frames", 4, lambda: next(tries)) as update:
        update(1)
        assert str(watch.due(2.0)).startswith("x: try 1, 2 s, frames 1 of 4, to go")
        update(4)  # what follows is no more these frames
        assert watch.due(4.0) == "x: try 2, 4 s"
        with doing("writing a.npz"):
            assert watch.due(6.0) == "x: writing a.npz, 6 s"
    assert watch.due(8.0) == "x: working, 8 s"
