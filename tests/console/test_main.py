"""`python -m console` is the command."""

import os
import subprocess
import sys

import pytest

from tests.support.paths import ROOT


def environment() -> dict[str, str]:
    """Without a MUJOCO_GL, which other tests set here: MuJoCo is imported to try it."""
    kept = {k: v for k, v in os.environ.items() if k not in ("MUJOCO_GL", "PYOPENGL_PLATFORM")}
    return kept | {"PYTHONPATH": str(ROOT)}


def test_the_exit_code_is_the_commands() -> None:
    words = [sys.executable, "-m", "console", "motions", "fly"]
    done = subprocess.run(words, env=environment(), capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.startswith("inhabit: ")


#: Runs the command in a process with a module whose teardown is seen.
ENDING = """
import atexit, sys
from console.__main__ import main
class Loud:
    def __del__(self):
        print("torn down")
kept = Loud()
code = main()
atexit.register(print, "registered function")  # as modules do that a command imports
sys.exit(code)
"""


@pytest.mark.parametrize(("words", "code"), [(["--version"], 0), (["motions", "fly"], 2)])
def test_the_process_ends_without_the_teardown_of_modules(words: list[str], code: int) -> None:
    """Functions registered with atexit run, what was printed is written, and the code is kept."""
    done = subprocess.run(
        [sys.executable, "-c", ENDING, *words], env=environment(), capture_output=True, text=True
    )
    assert done.returncode == code
    assert "registered function" in done.stdout and "torn down" not in done.stdout


#: Prints the heavy packages that a command has imported when its first line can be printed.
IMPORTED = """
import importlib, sys
from console import app, inputs
command = app.parse(sys.argv[1:])
inputs.require(command)
if sys.argv[1] == "doctor":
    importlib.import_module("console.doctor.command")
heavy = {"numpy", "torch", "mujoco", "ray", "scipy", "trimesh", "tensorboard", "PIL"}
print(*sorted(heavy & set(sys.modules)))
"""


@pytest.mark.parametrize(
    ("line", "needed"),
    [("doctor", []), ("train sit", []), ("evaluate sit", ["numpy"]), ("motions list", [])],
)
def test_no_heavy_package_delays_the_first_line(line: str, needed: list[str]) -> None:
    """The names of the catalogue's splits, which --objects takes, need numpy."""
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED, *line.split()],
        env=environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == needed


def test_processes_of_a_training_start_without_what_they_may_not_need() -> None:
    """Imported pieces need scipy, Ray its runner, torch.compile is not used."""
    listed = """
import sys
import console.training.command
unwanted = {"scipy", "trimesh", "ray", "PIL", "tensorboard", "torch._dynamo"}
print(*sorted(unwanted & set(sys.modules)))
"""
    done = subprocess.run(
        [sys.executable, "-c", listed],
        env=environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == []


def test_an_interrupt_while_the_command_line_is_imported_says_nothing() -> None:
    """Ctrl-C in the first half second: no traceback, and the exit code of an interrupt."""
    script = (
        "import sys, console.__main__ as command\n"
        "class Interrupts:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'console.app': raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupts())\n"
        "sys.exit(command.main())\n"
    )
    ran = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 130 and ran.stderr == "" and ran.stdout == ""
