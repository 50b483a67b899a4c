"""`inhabit doctor`: what this machine has of what training needs, and what to do about the rest."""

import importlib.metadata
import json
import os
import platform
import shutil
import socket
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from console.commands import Doctor
from console.machine import cores, memory_gb, versions

Verdict = Literal["ok", "mind", "bad"]


@dataclass(frozen=True)
class Finding:
    """One thing looked at: `bad` keeps training from working, `mind` costs something."""

    name: str
    verdict: Verdict
    detail: str


def check_python() -> Finding:
    version = platform.python_version()
    return Finding("python", "ok", version)


def check_packages() -> Finding:
    """Versions of what the numbers depend on, and the one MuJoCo release that is known bad."""
    found = versions()
    missing = [name for name, version in found.items() if version is None]
    if missing:
        return Finding("packages", "bad", f"missing: {', '.join(missing)}; run `make install`")
    if found["mujoco"] == "4.0.0":
        return Finding("packages", "bad", "mujoco 4.0.0 factorises wrongly: install 3.17 or 4.0.1")
    return Finding("packages", "ok", ", ".join(f"{n} {v}" for n, v in found.items()))


def check_cores() -> Finding:
    count = cores()
    detail = f"{count} usable, of {os.cpu_count()}"
    return Finding("cores", "ok" if count > 1 else "mind", detail)


def check_memory() -> Finding:
    total = memory_gb()
    if total < 4:
        return Finding("memory", "mind", f"{total:.1f} GB: lower --scenes (512 want about 3 GB)")
    return Finding("memory", "ok", f"{total:.1f} GB")


def check_precision() -> Finding:
    """Which number format the networks run in, and why."""
    import torch

    from policy.precision import decide

    device = "cuda" if torch.cuda.is_available() else "cpu"
    return Finding("precision", "ok", f"{device}: {decide(device).reason}")


def check_simulator() -> Finding:
    """One step of a batch."""
    import mujoco
    from mujoco.batch import Batch

    xml = "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>"
    batch = Batch(mujoco.MjModel.from_xml_string(xml), 2, 1)
    batch.step()
    return Finding("simulator", "ok", f"mujoco.batch steps ({mujoco.__version__})")


def check_motions() -> Finding:
    from console.motions import clips

    return Finding("motions", "ok", f"{len(clips(()))} clips come with the package")


def check_rendering() -> Finding:
    """Whether `video` can draw here."""
    from console.video import choose_gl

    backend = choose_gl()
    if backend is None:
        return Finding("rendering", "mind", "no OpenGL: for `video`, apt-get install libosmesa6")
    return Finding("rendering", "ok", f"MUJOCO_GL={backend}")


def check_ffmpeg() -> Finding:
    import imageio_ffmpeg

    return Finding("ffmpeg", "ok", imageio_ffmpeg.get_ffmpeg_version())


def check_ray() -> Finding:
    return Finding("ray", "ok", importlib.metadata.version("ray"))


def check_port() -> Finding:
    """The style service needs a loopback port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
    return Finding("sockets", "ok", "loopback ports can be bound")


def check_disk() -> Finding:
    """Room for checkpoints where runs go."""
    with tempfile.NamedTemporaryFile(dir=Path.cwd()):
        free = shutil.disk_usage(Path.cwd()).free / 1e9
    detail = f"{free:.0f} GB free here"
    return Finding("disk", "ok" if free > 2 else "mind", detail)


CHECKS: tuple[Callable[[], Finding], ...] = (
    check_python,
    check_packages,
    check_cores,
    check_memory,
    check_precision,
    check_simulator,
    check_motions,
    check_rendering,
    check_ffmpeg,
    check_ray,
    check_port,
    check_disk,
)


def examine(checks: tuple[Callable[[], Finding], ...] = CHECKS) -> list[Finding]:
    """Every finding; a check that itself fails becomes a bad finding with its reason."""
    findings = []
    for check in checks:
        try:
            findings.append(check())
        except Exception as error:  # a doctor examines what is broken: nothing may stop it
            name = check.__name__.removeprefix("check_")
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            findings.append(Finding(name, "bad", reason))
    return findings


def as_json(findings: list[Finding]) -> list[dict[str, str]]:
    """The findings as JSON values."""
    return [asdict(finding) for finding in findings]


def doctor_command(command: Doctor) -> int:
    """Print the findings; 1 if anything is bad."""
    findings = examine()
    if command.json:
        print(json.dumps(as_json(findings), indent=2))
    else:
        for finding in findings:
            print(f"{finding.verdict:4s}  {finding.name:10s}  {finding.detail}")
    return 1 if any(finding.verdict == "bad" for finding in findings) else 0
