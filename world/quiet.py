"""MuJoCo's warnings, kept out of the working folder, and its timers, which are off.

MuJoCo writes warnings to MUJOCO_LOG.TXT there. They are counted in `MjData.warning`, which the
callers read. Imported by the modules that compile models.

The Python bindings of MuJoCo install a clock, which each step reads 30 times for `MjData.timer`:
3.5 % of a step with few contacts. Nothing here reads the timers but `inhabit bench profile`.
"""

import contextlib
import ctypes
from collections.abc import Iterator
from pathlib import Path

import mujoco


def _drop(_text: str) -> None:
    """Drop a warning."""


def _clock() -> ctypes.c_void_p | None:
    """The pointer `mjcb_time` of MuJoCo's library; None where the library is not found."""
    folder = Path(mujoco.__file__).parent
    for pattern in ("libmujoco*", "mujoco.dll"):
        for path in folder.glob(pattern):
            with contextlib.suppress(OSError, ValueError):
                return ctypes.c_void_p.in_dll(ctypes.CDLL(str(path)), "mjcb_time")
    return None


def stop_timers() -> None:
    """Take MuJoCo's clock away: its steps are the same, `MjData.timer` counts no time."""
    # the bindings install their clock again in place of none, so that the pointer itself is cleared
    if _CLOCK is not None:
        _CLOCK.value = None


@contextlib.contextmanager
def timers() -> Iterator[None]:
    """Time the parts of MuJoCo's steps in `MjData.timer` meanwhile."""
    mujoco.set_mjcb_time(None)
    try:
        yield
    finally:
        stop_timers()


_CLOCK = _clock()
mujoco.set_mju_user_warning(_drop)
stop_timers()
