"""`inhabit doctor`: checks of what training needs, with advice on what is missing."""

import json
import os
import platform
import shutil
import socket
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pretrained
from console.commands import Doctor
from console.doctor.finding import Finding
from console.run.machine import cores, memory_gb, versions
from console.terminal import doing
from rpc.credentials import read_token
from world import surroundings


def check_python() -> Finding:
    version = platform.python_version()
    return Finding("python", "ok", version)


def check_packages() -> Finding:
    """Check the versions of packages, and against the one bad release of MuJoCo."""
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
        return Finding("memory", "mind", f"{total:.1f} GB: lower --scenes (512 need about 3 GB)")
    return Finding("memory", "ok", f"{total:.1f} GB")


def check_precision() -> Finding:
    """Report the number format of the networks and its reason."""
    import torch

    from world.precision import decide

    device = "cuda" if torch.cuda.is_available() else "cpu"
    return Finding("precision", "ok", f"{device}: {decide(device).reason}")


def check_simulator() -> Finding:
    """Step a batch of the simulator."""
    import mujoco
    from mujoco.batch import Batch

    import world.quiet  # noqa: F401  # pyright: ignore[reportUnusedImport]

    xml = "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>"
    batch = Batch(mujoco.MjModel.from_xml_string(xml), 2, 1)
    batch.step()
    return Finding("simulator", "ok", f"mujoco.batch steps ({mujoco.__version__})")


def check_motions(paths: tuple[Path, ...] = ()) -> Finding:
    """Check that clips can be read; report their licences."""
    from console.motions.reading import clips

    found = clips(tuple(map(str, paths)))
    minutes = sum(clip.seconds for clip in found) / 60
    terms = ", ".join(sorted({clip.licence for clip in found}))
    where = "found" if paths else "of the package"
    detail = f"{len(found)} clips, {minutes:.0f} minutes, {where}; licence: {terms}"
    return Finding("motions", "ok", detail)


def check_policies() -> Finding:
    """Report the policies that commands find by name."""
    found = pretrained.names()
    if not found:
        return Finding("policies", "mind", "none here: `inhabit train sit` trains one")
    return Finding("policies", "ok", f"by name (`inhabit play NAME`): {', '.join(found)}")


def check_rendering() -> Finding:
    """Check offscreen rendering."""
    from console.video.rendering import choose_gl, gl_problem

    backend = choose_gl()
    set_to = surroundings.missing_gl or os.environ.get("MUJOCO_GL")
    if backend is None:
        why = f"{gl_problem()}: " if set_to else "no OpenGL: "
        return Finding("rendering", "mind", f"{why}for `video`, apt-get install libosmesa6")
    if surroundings.missing_gl is not None:
        detail = f"{surroundings.missing_gl}; `video` uses {backend}: unset MUJOCO_GL"
        return Finding("rendering", "mind", detail)
    return Finding("rendering", "ok", f"MUJOCO_GL={backend}")


def check_ffmpeg() -> Finding:
    import imageio_ffmpeg

    return Finding("ffmpeg", "ok", imageio_ffmpeg.get_ffmpeg_version())


def check_ray(address: str | None) -> Finding:
    from console.doctor.cluster import find_ray

    return find_ray(address)


def check_service(name: str, address: str, *tls: Path | None) -> Finding:
    from console.doctor.cluster import find_service

    return find_service(name, address, *tls)


def check_rate(seconds: float) -> Finding:
    """Measure samples/s of a few seconds of training."""
    from console.doctor.rate import estimate

    return estimate(seconds)


def check_port() -> Finding:
    """Check that the style service can bind a loopback port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
    return Finding("sockets", "ok", "loopback ports can be bound")


def check_disk() -> Finding:
    """Check the disk space for checkpoints in this folder."""
    with tempfile.NamedTemporaryFile(dir=Path.cwd()):
        free = shutil.disk_usage(Path.cwd()).free / 1e9
    detail = f"{free:.0f} GB free here"
    return Finding("disk", "ok" if free > 2 else "mind", detail)


def check_token(path: Path) -> Finding:
    """Check that a token can be read, and by its owner alone."""
    read_token(str(path))
    mode = path.stat().st_mode & 0o777
    if mode & 0o077:
        return Finding("token", "mind", f"{path}: others can read it ({mode:o}): chmod 600 {path}")
    return Finding("token", "ok", f"{path}: readable by its owner alone")


CHECKS: tuple[Callable[[], Finding], ...] = (
    check_python,
    check_packages,
    check_cores,
    check_memory,
    check_precision,
    check_simulator,
    check_motions,
    check_policies,
    check_rendering,
    check_ffmpeg,
    check_port,
    check_disk,
)


def examine(checks: tuple[Callable[[], Finding], ...] = CHECKS) -> Iterator[Finding]:
    """Yield the finding of each check; a check that raises gives a bad finding with its reason."""
    for check in checks:
        function = check.func if isinstance(check, partial) else check
        name = getattr(function, "__name__", "check").removeprefix("check_")
        if name == "service" and isinstance(check, partial):
            name = check.args[0]
        try:
            with doing(f"measuring the {name}" if name == "rate" else f"checking {name}"):
                found = check()
        except Exception as error:  # any fault of a machine is a finding
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            found = Finding(name, "bad", reason)
        yield found


def as_json(findings: list[Finding]) -> list[dict[str, str]]:
    """Return the findings as JSON values."""
    kept = ("name", "verdict", "detail")
    return [{key: getattr(finding, key) for key in kept} for finding in findings]


def checks_of(command: Doctor) -> tuple[Callable[[], Finding], ...]:
    """Return the checks of the flags: always the machine, and the given services."""
    checks: list[Callable[[], Finding]] = [
        partial(check_motions, command.motions) if check is check_motions else check
        for check in CHECKS
    ]
    checks.append(partial(check_ray, command.address))
    tls = (command.tls_ca, command.tls_cert, command.tls_key)
    for name, address in (("style", command.style), ("policy", command.policy)):
        if address:
            checks.append(partial(check_service, name, address, *tls))
    if command.token_file is not None:
        checks.append(partial(check_token, command.token_file))
    if command.seconds > 0:
        checks.append(partial(check_rate, command.seconds))
    return tuple(checks)


def next_command(findings: list[Finding], command: Doctor) -> str:
    """Return the command to run next."""
    bad = [finding.name for finding in findings if finding.verdict == "bad"]
    if bad:
        return f"fix first: {', '.join(bad)}"
    words = ["inhabit train sit"]
    ray = next((f for f in findings if f.name == "ray"), None)
    slots = None if ray is None else ray.slots
    if slots:
        actors = max(1, slots - 1)
        words.append(f"--runner ray --actors {actors} --scenes {max(512, 64 * actors)}")
        words += [f"--address {command.address}"] if command.address else []
        words += [f"--style-service.address {command.style}"] if command.style else []
    words += [f"--motions {' '.join(map(str, command.motions))}"] if command.motions else []
    return " ".join(words)


def doctor_command(command: Doctor) -> int:
    """Print the findings; return 1 if any is bad."""
    findings: list[Finding] = []

    def found(finding: Finding) -> None:
        findings.append(finding)
        if not command.json:
            print(f"{finding.verdict:4s}  {finding.name:10s}  {finding.detail}")

    for finding in examine(checks_of(command)):
        found(finding)
    found(Finding("next", "ok", next_command(findings, command)))
    if command.json:
        print(json.dumps(as_json(findings), indent=2))
    return 1 if any(finding.verdict == "bad" for finding in findings) else 0
