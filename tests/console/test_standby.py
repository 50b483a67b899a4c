"""Signs of life while a library holds the interpreter."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from console import standby
from tests.support.paths import ROOT

#: Holds the interpreter, as a library that does not release it does, until a byte comes.
HOLDS = """
import ctypes, os, sys
from console import standby, terminal
terminal.SILENCE_S = standby.HELD_S = 0.05
terminal._STANDBY_AFTER_S = 0.0
library = ctypes.PyDLL(None)
with terminal.signs_of_life("inhabit x"), terminal.doing("connecting"):
    sys.stdin.buffer.read(1)  # signs of life come from the command itself
    library.read(0, ctypes.create_string_buffer(1), 1)
os.write(1, b"done")
"""


def test_the_line_says_stage_seconds_and_work() -> None:
    line = standby.told(5.0, 1.0, "inhabit train: a\tb\nc", ", trials 3 of 9, to go 0:12")
    assert line.count(b"\n") == 1
    said = standby.due(line, 0.0, 7.4, 1.0)
    assert said == "inhabit train: a b c, 6 s, trials 3 of 9, to go 0:12"
    assert standby.due(line, 0.0, 5.9, 1.0) is None, "the command wrote 0.9 s ago"
    assert standby.due(line, 7.4, 8.3, 1.0) is None, "this process wrote 0.9 s ago"


def test_a_long_line_is_told_as_a_whole() -> None:
    line = standby.told(5.0, 1.0, "ж" * 9000, "ж" * 9000)
    assert len(line) < 4096, "what a pipe takes at a time"
    assert standby.due(line, 0.0, 7.0, 1.0) == f"{'ж' * 400}, 6 s{'ж' * 400}"


@pytest.fixture
def speaker() -> Iterator[subprocess.Popen[bytes]]:
    words = [sys.executable, "-I", "-S", standby.__file__, "0.01", "0.01", "file"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        yield process
        process.kill()


def test_it_speaks_where_nothing_is_told_and_ends_with_the_command(
    speaker: subprocess.Popen[bytes],
) -> None:
    assert speaker.stdin is not None and speaker.stderr is not None
    speaker.stdin.write(standby.told(0.0, 0.0, "inhabit x: connecting", ""))
    speaker.stdin.flush()
    first, second = speaker.stderr.readline(), speaker.stderr.readline()
    assert first.startswith(b"inhabit x: connecting, ") and second.startswith(b"inhabit x: ")
    os.kill(speaker.pid, signal.SIGINT)  # Ctrl-C reaches all processes of a terminal
    assert speaker.stderr.readline().startswith(b"inhabit x: ")
    speaker.stdin.close()
    assert speaker.wait(60) == 0


def test_a_command_that_was_stopped_is_no_busy_one() -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        assert not standby.is_stopped(process.pid)
        os.kill(process.pid, signal.SIGSTOP)
        os.waitpid(process.pid, os.WUNTRACED)
        assert standby.is_stopped(process.pid)
        os.kill(process.pid, signal.SIGCONT)
        process.communicate(b"\n")
    assert not standby.is_stopped(process.pid)


def test_a_held_interpreter_is_not_silent() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLDS],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=ROOT,
        bufsize=0,
    ) as process:
        assert process.stdin is not None and process.stderr is not None
        late = threading.Timer(60.0, process.kill)  # a reader of a silent process waits for ever
        late.start()
        assert process.stderr.readline().startswith(b"inhabit x: connecting, ")
        process.stdin.write(b"1")
        for _ in range(20):  # the command's own, at most one is on its way, and then the other's
            assert process.stderr.readline().startswith(b"inhabit x: connecting, ")
        process.stdin.write(b"2")
        out, _ = process.communicate(timeout=60)
        late.cancel()
    assert out == b"done" and process.returncode == 0
