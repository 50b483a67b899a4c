"""A process of its own that runs some code: signals end it, and not the tests."""

import os
import subprocess
import sys


def printed(code: str, ends_with: int = 0) -> str:
    """What the code prints, stripped. AssertionError with its errors for another exit code."""
    ended = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env=dict(os.environ, PYTHONPATH=os.pathsep.join(sys.path)),
        timeout=120,
    )
    assert ended.returncode == ends_with, ended.stderr
    return ended.stdout.strip()
