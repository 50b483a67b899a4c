"""Files and folders that appear whole or not at all, and locks of folders.

The former are written beside their place, under a name that nobody can foresee: a link or a file
that another user laid there could else redirect what is written, or stop it.
"""

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

#: How the names end, so that what a killed process left can be found (`leftovers`).
SUFFIX = ".partial"


@contextmanager
def replacing(path: Path, ending: str | None = None) -> Iterator[Path]:
    """Within it a new, empty file to write, with the suffix of `path`, or `ending`; then it is
    `path`.

    It has the permissions that a new file has. After an error it is removed, and `path` stays.
    """
    handle, name = tempfile.mkstemp(
        prefix=f".{path.name}.",
        suffix=SUFFIX + (path.suffix if ending is None else ending),
        dir=path.parent,
    )
    os.close(handle)
    partial = Path(name)
    try:
        yield partial
        partial.chmod(0o666 & ~_umask())
        partial.replace(path)
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Within it a new, empty folder to fill; then it is `path`, in place of a folder that was."""
    partial = Path(tempfile.mkdtemp(prefix=f".{path.name}.", suffix=SUFFIX, dir=path.parent))
    try:
        yield partial
        partial.chmod(0o777 & ~_umask())
        if path.exists() or path.is_symlink():
            with tempfile.TemporaryDirectory(
                prefix=f".{path.name}.", suffix=SUFFIX, dir=path.parent, ignore_cleanup_errors=True
            ) as folder:
                before = Path(folder) / path.name
                path.rename(before)
                try:
                    partial.rename(path)
                except OSError:
                    before.rename(path)
                    raise
        else:
            partial.rename(path)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def link(path: Path, target: str) -> None:
    """Make `path` a symbolic link to `target`, in place of what it was."""
    with tempfile.TemporaryDirectory(
        prefix=f".{path.name}.", suffix=SUFFIX, dir=path.parent
    ) as folder:
        made = Path(folder) / path.name
        made.symlink_to(target)
        made.replace(path)


def remove_leftovers(folder: Path) -> None:
    """Remove what a killed process left in a folder that nobody else writes to now."""
    for partial in folder.glob(f".*{SUFFIX}*"):
        if partial.is_dir() and not partial.is_symlink():
            shutil.rmtree(partial, ignore_errors=True)
        else:
            with suppress(OSError):
                partial.unlink(missing_ok=True)


def locked(folder: Path) -> int | None:
    """Lock a folder for this process, by a file `.lock` in it; None where another has it.

    Returns a handle to close. The kernel releases the lock when the process ends, in whatever way.
    """
    handle = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT, 0o644)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        return None
    return handle


def _umask() -> int:
    """The process's mask; the system tells it only while it sets one, so /proc is asked first."""
    with suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/self/status").read_text().splitlines()
        return int(next(line for line in lines if line.startswith("Umask:")).split()[1], 8)
    return 0o022
