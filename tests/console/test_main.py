"""`python -m console` is the command."""

import os
import subprocess
import sys

from tests.support.paths import ROOT


def test_the_exit_code_is_the_commands() -> None:
    environment = dict(os.environ, PYTHONPATH=str(ROOT))
    words = [sys.executable, "-m", "console", "motions", "fly"]
    done = subprocess.run(words, env=environment, capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.startswith("inhabit: ")
