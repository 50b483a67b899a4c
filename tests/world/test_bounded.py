"""Work in bounded processes: what breaks its bounds is ended, alone, and Ctrl-C ends all."""

import os
import signal
import subprocess
import sys
import time
from typing import Any

import pytest

from tests.support.paths import ROOT
from world.bounded import Bounds, Task, run
from world.errors import ClipError

LAVISH = Bounds(cpu_s=60, wall_s=120, memory_bytes=1 << 30)


def work(what: str) -> Any:
    """What a task of these tests does."""
    match what:
        case "spin":
            while True:
                pass
        case "hang":
            time.sleep(1000)
        case "eat":
            return len(bytearray(8 << 30))
        case "die":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "refuse":
            raise ClipError("x.bvh: no motion")
        case "fail":
            raise RuntimeError("two\nlines")
        case "print":
            print("noise of a library")
    return {"did": what}


def results(bounds: Bounds, *names: str) -> dict[str, Any]:
    tasks = [Task(f"{name}.file", (name,), bounds) for name in names]
    return {names[i]: result for i, result in run(tasks, work, 2, "leave it out")}


def test_each_end_is_its_own_task_s_alone(capfd: pytest.CaptureFixture[str]) -> None:
    found = results(LAVISH, "die", "eat", "refuse", "fail", "print")
    assert found["print"].value == {"did": "print"} and not found["print"].refused
    assert capfd.readouterr().out == ""
    assert found["refuse"].refused == "x.bvh: no motion"
    assert found["fail"].refused == "fail.file: RuntimeError: two lines"
    assert found["die"].refused == "die.file: its process failed (exit -11); leave it out"
    assert found["eat"].refused == "eat.file: needs more than 1 GiB; leave it out"
    assert {name for name, one in found.items() if one.died} == {"die"}


def test_time_is_bounded_by_processor_and_by_clock() -> None:
    (spun,) = results(Bounds(1, 100, 1 << 30), "spin").values()
    assert spun.refused == "spin.file: not done after 1 s of processor time; leave it out"
    (hung,) = results(Bounds(50, 1, 1 << 30), "hang").values()
    assert hung.refused == "hang.file: not done after 1 s; leave it out" and hung.died


def test_ctrl_c_ends_all_at_once() -> None:
    """A real command with a real signal: no process of it is left."""
    code = (
        "import signal\n"
        "from tests.world.test_bounded import LAVISH, work\n"
        "from world.bounded import Task, run\n"
        "if __name__ == '__main__':\n"
        # tests that a shell runs in its background are born with the signal ignored
        "    signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "    print('ready', flush=True)\n"
        "    list(run([Task('a', (w,), LAVISH) for w in ('hang', 'spin')], work, 2))\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, start_new_session=True, env=dict(os.environ, PYTHONPATH=str(ROOT)),
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    deadline = time.monotonic() + 60
    while len(members(process.pid)) < 4 and time.monotonic() < deadline:
        time.sleep(0.1)  # itself, the server of forks, both tasks
    time.sleep(0.5)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert "KeyboardInterrupt" in said
    deadline = time.monotonic() + 60
    while members(process.pid) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert members(process.pid) == []


def members(group: int) -> list[int]:
    """Processes of a session that are alive."""
    found = []
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{name}/stat") as file:
                words = file.read().rpartition(")")[2].split()
        except OSError:
            continue
        if int(words[3]) == group and words[0] != "Z":
            found.append(int(name))
    return found
