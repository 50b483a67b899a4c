"""Description of the machine of a result: cores, memory, versions, commit."""

import importlib.metadata
import os
import platform
import subprocess
from pathlib import Path
from typing import Any

PACKAGES = ("mujoco", "torch", "numpy", "ray", "grpcio", "protobuf", "safetensors", "msgpack")


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def memory_gb() -> float:
    """Return the physical memory, GB."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9


def resident_gb(pid: int | str = "self") -> float:
    """Return the resident memory of one process, GB; 0 if unavailable."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e9


def process_tree() -> set[int]:
    """Return the ids of this process and all its descendants."""
    parents: dict[int, int] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue  # the process has ended
        parents[int(stat.parent.name)] = int(fields[1])
    tree = {os.getpid()}
    while found := {pid for pid, parent in parents.items() if parent in tree} - tree:
        tree |= found
    return tree


def process_tree_gb() -> float:
    """Return the resident memory of this process and all its descendants, GB; shared pages count
    in each."""
    return sum(resident_gb(pid) for pid in process_tree())


def process_tree_seconds() -> float:
    """Return the processor seconds of this process and all its descendants that still run."""
    ticks = 0
    for pid in process_tree():
        try:
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue  # the process has ended
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def process_tree_peak_gb() -> float:
    """Return the sum of the peak resident memory of this process and all its descendants, GB; 0
    where unavailable."""
    found = 0.0
    for pid in process_tree():
        try:
            text = Path(f"/proc/{pid}/status").read_text()
        except OSError:
            continue  # the process has ended
        lines = [line.split() for line in text.splitlines() if line.startswith("VmHWM:")]
        found += sum(int(words[1]) for words in lines) * 1024 / 1e9
    return found


def processor() -> str:
    """Return the name of the processor."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def versions() -> dict[str, str | None]:
    """Return the installed versions of the packages that numbers depend on; None if missing."""
    found: dict[str, str | None] = {}
    for name in PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = None
    return found


def commit() -> str | None:
    """Return the git commit of the working tree, followed by `+` if it has changes; None outside a
    repository."""
    root = Path(__file__).resolve().parents[2]
    try:
        head = _git(root, "rev-parse", "HEAD")
        return head + ("+" if _git(root, "status", "--porcelain", "-uno") else "")
    except (OSError, subprocess.SubprocessError):
        return None


def _git(root: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", "-C", str(root), *arguments], capture_output=True, text=True, timeout=10, check=True
    )
    return done.stdout.strip()


def describe() -> dict[str, Any]:
    """Return processor, cores, memory, system and versions as JSON values."""
    return {
        "processor": processor(),
        "cores": cores(),
        "memory_gb": round(memory_gb(), 1),
        "system": platform.platform(),
        "python": platform.python_version(),
        "versions": versions(),
    }
