"""What a process inherits and must not stop the simulator: an OpenGL that is not there, a temporary
folder with a long name, a user without a home."""

import atexit
import multiprocessing.process
import os
import shutil
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

GL = "MUJOCO_GL"
LONGEST = 60
"""Greatest number of bytes of a folder for sockets: their paths have at most 107 in all."""
_SHORT = ("/tmp", "/var/tmp", "/dev/shm")


@dataclass(frozen=True)
class MissingGl:
    """A value of MUJOCO_GL with which MuJoCo cannot be imported."""

    value: str
    reason: str

    def __str__(self) -> str:
        return f"{GL}={self.value} is not there ({self.reason})"


missing_gl: MissingGl | None = None
"""The value given to this process or the one that started it; None for one that can be imported."""
_PASSED_ON = "INHABIT_MISSING_GL"
"""Variable by which child processes learn of it."""


def settle_gl() -> None:
    """Remove a MUJOCO_GL from the environment with which MuJoCo cannot be imported: only rendering
    needs OpenGL, which then chooses by itself, or refuses."""
    global missing_gl
    value, _, reason = os.environ.get(_PASSED_ON, "").partition("\n")
    if value:
        missing_gl = MissingGl(value, reason)
    wanted = os.environ.get(GL)
    if not wanted or "mujoco" in sys.modules:
        return
    reason = _why_missing(wanted.lower().strip())
    if reason is not None:
        missing_gl = MissingGl(wanted, reason)
        del os.environ[GL]
        os.environ[_PASSED_ON] = f"{missing_gl.value}\n{missing_gl.reason}"


def _why_missing(backend: str) -> str | None:
    """Why a backend is not there; None where MuJoCo is imported with it."""
    displays = ("DISPLAY", "WAYLAND_DISPLAY")
    if backend in ("glfw", "glx") and sys.platform == "linux" and not any(map(os.getenv, displays)):
        return "no display"
    try:
        import mujoco  # noqa: F401  # pyright: ignore[reportUnusedImport]
    except Exception as error:  # a backend fails in its own way
        for name in list(sys.modules):
            package, _, part = name.partition(".")
            # compiled modules cannot be imported twice
            if package == "OpenGL" or (package == "mujoco" and not part.startswith("_")):
                del sys.modules[name]
        if os.environ.get("PYOPENGL_PLATFORM") == backend:  # set by MuJoCo
            del os.environ["PYOPENGL_PLATFORM"]
        found = " ".join(str(error).split())[:120]
        if "invalid value" in found:
            return "choose egl, osmesa or glfw"
        return f"{type(error).__name__}: {found}"
    return None


def short_folder() -> str | None:
    """A folder for sockets where that for temporary files has too long a name; None where it is
    short, or no other can be written."""
    if len(os.fsencode(tempfile.gettempdir())) <= LONGEST:
        return None
    return next((name for name in _SHORT if os.access(name, os.W_OK | os.X_OK)), None)


def settle_sockets() -> None:
    """Put the sockets of `multiprocessing` where their paths are short enough."""
    # `multiprocessing` has no public setting for its folder
    config = multiprocessing.process.current_process().__dict__["_config"]
    short = None if config.get("tempdir") else short_folder()
    if short is not None:
        own = tempfile.mkdtemp(prefix="inhabit-", dir=short)
        config["tempdir"] = own
        atexit.register(shutil.rmtree, own, ignore_errors=True)


def home() -> Path | None:
    """The user's home; None for a user without one."""
    try:
        return Path.home()
    except RuntimeError:
        return None


def expanded(path: Path) -> Path:
    """A path with `~` replaced by the home; as it is for a user without one."""
    try:
        return path.expanduser()
    except RuntimeError:
        return path


def cache_folder() -> Path | None:
    """$XDG_CACHE_HOME/inhabit, or .cache/inhabit in the user's home; None without either."""
    base = os.environ.get("XDG_CACHE_HOME")
    if base:
        return Path(base) / "inhabit"
    own = home()
    return None if own is None else own / ".cache" / "inhabit"
