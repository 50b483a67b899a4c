"""`inhabit`, also `python -m console`: runs the command line and ends the process."""

import atexit
import contextlib
import os
import sys

#: As console.app has it, whose import may be what is interrupted.
_INTERRUPTED = 130
_codes: list[int] = []


def main() -> int:
    """Run the command line; return the exit code, with which the process then ends.

    It ends after the functions registered with atexit, without the teardown of modules: torch's
    alone takes a second, in which the command would be silent.
    """
    # registered before the imports that register others, and so called after all of them
    atexit.register(_end)
    try:
        from console import app

        _codes.append(app.main())
    except KeyboardInterrupt:  # before the command line answers to it
        _codes.append(_INTERRUPTED)
    return _codes[-1]


def _end() -> None:
    if not _codes:
        return  # an exception ends the process
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(_codes[-1])


if __name__ == "__main__":
    sys.exit(main())
