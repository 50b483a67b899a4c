"""Training on a machine without network: what it needs in parts with checksums, and the way back.

    python deploy/offline.py pack PARTS --have torch,numpy --without ray --add start=runs/sit
    python offline.py unpack PARTS --into HERE          (there; the script lies beside the parts)
    python offline.py train sit --here HERE --minutes 9 --init start --out OUT
    python deploy/offline.py join OUT --into runs/sit   (back here: a run to resume)

It needs Python and pip alone. docs/how-to/offline-machine.md has the whole way.
"""

import argparse
import hashlib
import io
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import tomllib
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO, Any

ROOT = Path(__file__).resolve().parent.parent
MANIFEST = "manifest.json"
#: Tags of wheels that a glibc of 2.28 or newer runs.
_PLATFORMS = [f"manylinux_2_{minor}_x86_64" for minor in (28, 27, 24, 17, 12, 5)]
_PLATFORMS += [f"manylinux{year}_x86_64" for year in ("2014", "2010", "1")]
#: Of mujoco-warp's compiler, what only its CPU device needs: 69 MB.
_CPU_COMPILER = "warp/bin/warp-clang.so"
_MB = 1_000_000


class OfflineError(Exception):
    """One line on what is wrong."""


def pack(
    out: Path,
    *,
    part_mb: float = 60,
    python: str = "3.12",
    have: Sequence[str] = (),
    without: Sequence[str] = (),
    extras: Sequence[str] = (),
    add: Sequence[str] = (),
    slim: bool = False,
    requirements: Sequence[str] | None = None,
) -> dict[str, Any]:
    """Write the parts of everything that training needs into the folder `out`; its manifest.

    have: packages that the machine has; without: packages that are left out; add: NAME=PATH of
    clips, objects or runs; slim: warp without its CPU compiler; requirements: instead of the
    package's own.
    """
    added = dict(_named(word) for word in add)
    if out.exists() and any(out.iterdir()):
        raise OfflineError(f"{out} is not empty: name another folder")
    skipped = {_normal(name) for name in (*have, *without)}
    wanted = [r for r in requirements or _requirements(extras) if _normal(_name(r)) not in skipped]
    with tempfile.TemporaryDirectory() as folder:
        wheels = Path(folder) / "wheels"
        _download(wanted, wheels, python)
        for wheel in sorted(wheels.iterdir()):
            if _normal(_name(wheel.name)) in skipped:
                wheel.unlink()
            elif slim and _normal(_name(wheel.name)) == "warp-lang":
                _lighten(wheel)
        names = sorted(wheel.name for wheel in wheels.iterdir())
        payload = Path(folder) / "payload.tar"
        with tarfile.open(payload, "w") as tar:
            for name in names:
                tar.add(wheels / name, f"wheels/{name}")
            _add_repository(tar)
            for name, path in added.items():
                tar.add(path, f"data/{name}")
        out.mkdir(parents=True, exist_ok=True)
        parts = cut(payload, out, "part", round(part_mb * _MB))
    manifest = {"python": python, "wheels": names, "data": sorted(added), "parts": parts}
    (out / MANIFEST).write_text(json.dumps(manifest, indent=1))
    shutil.copy(__file__, out / "offline.py")
    return manifest


def unpack(parts: Path, into: Path, target: Path | None = None, system: bool = True) -> Path:
    """Join and install what `pack` wrote; the Python to run it with.

    target: install into this folder, for PYTHONPATH, instead of a virtual environment; system: what
    the machine has can be seen in the environment.
    """
    manifest = _read(parts)
    have = "{}.{}".format(*sys.version_info[:2])
    if manifest["python"] != have:
        raise OfflineError(f"{parts} is for Python {manifest['python']}, this is {have}")
    if into.exists() and any(into.iterdir()):
        raise OfflineError(f"{into} is not empty: name another folder")
    into.mkdir(parents=True, exist_ok=True)
    extract(parts, manifest["parts"], into)
    wheels = [str(into / "wheels" / name) for name in manifest["wheels"]]
    install = ["install", "-q", "--disable-pip-version-check", "--no-index", "--no-deps"]
    if target is not None:
        _call([sys.executable, "-m", "pip", *install, "--target", str(target), *wheels])
        return Path(sys.executable)
    # without a pip of its own, which not every Python can give it
    venv = into.resolve() / "venv"
    shared = ["--system-site-packages"] if system else []
    _call([sys.executable, "-m", "venv", "--without-pip", *shared, str(venv)])
    python = venv / "bin" / "python"
    if wheels:
        _call([sys.executable, "-m", "pip", "--python", str(python), *install, *wheels])
    paths = [into.resolve() / "repository"]
    if system and sys.prefix != sys.base_prefix:
        # an environment's environment sees the system's packages, not those of the first
        paths.append(Path(sysconfig.get_path("purelib")))
    site = next(venv.glob("lib/python*/site-packages"))
    (site / "inhabit.pth").write_text("".join(f"{path}\n" for path in paths))
    return python


def train(
    task: str,
    here: Path,
    minutes: float,
    out: Path,
    init: str | None = None,
    trials: int = 256,
    flags: Sequence[str] = (),
    most_mb: float = 60,
) -> int:
    """Train for so long in what `unpack` made, evaluate, and leave all of it in the folder `out`:
    at most eight files of at most 16 MiB, `most_mb` together.

    init: a name that was packed, or a path. A run that is there goes on.
    """
    here = here.resolve()
    python = here / "venv" / "bin" / "python"
    command = [str(python if python.exists() else sys.executable), "-m", "console"]
    run, repository = (here / "runs" / task).resolve(), here / "repository"
    start: list[str] = []
    if (run / "config.json").exists():
        start = ["--resume"]
    elif init is not None:
        packed = here / "data" / init
        start = ["--init", str((packed if packed.exists() else Path(init)).resolve())]
    words = [*command, "train", task, "--run", str(run), "--minutes", str(minutes), *start, *flags]
    _call(words, repository)
    out.mkdir(parents=True, exist_ok=True)
    evaluation = (out / "evaluation.json").resolve()
    words = [*command, "evaluate", str(run), "--trials", str(trials), "--json", str(evaluation)]
    _call(words, repository)
    _call([command[0], "-m", "policy.checkpoints.trimmed", str(run), str(most_mb - 6)], repository)
    with tempfile.TemporaryDirectory() as folder:
        payload = Path(folder) / "run.tar"
        with tarfile.open(payload, "w") as tar:
            tar.add(run / "trimmed", "checkpoints/trimmed")
            for name in ("config.json", "metrics.jsonl"):
                tar.add(run / name, name)
        shutil.rmtree(run / "trimmed")
        parts = cut(payload, out, "run", 16 * 2**20)
    (out / MANIFEST).write_text(json.dumps({"task": task, "parts": parts}, indent=1))
    return sum(path.stat().st_size for path in out.iterdir())


def join(parts: Path, into: Path) -> Path:
    """The run that `train` left in parts, in a new folder: `inhabit train --run INTO --resume`."""
    manifest = _read(parts)
    if into.exists() and any(into.iterdir()):
        raise OfflineError(f"{into} is not empty: name another folder")
    into.mkdir(parents=True, exist_ok=True)
    extract(parts, manifest["parts"], into)
    trimmed = into / "checkpoints" / "trimmed"
    iteration = json.loads((trimmed / "manifest.json").read_text())["iteration"]
    trimmed.rename(trimmed.with_name(f"{iteration:06d}"))
    (into / "checkpoints" / "latest").symlink_to(f"{iteration:06d}")
    for folder in ("tensorboard", "evaluations"):
        (into / folder).mkdir()
    if (parts / "evaluation.json").exists():
        shutil.copy(parts / "evaluation.json", into / "evaluations" / "there.json")
    return into


def cut(payload: Path, out: Path, stem: str, most: int) -> list[dict[str, Any]]:
    """A file as parts of at most `most` bytes in `out`: their names, sizes, digests, in order."""
    if most < 1:
        raise OfflineError("--part-mb must be above 0")
    parts = []
    with payload.open("rb") as stream:
        while chunk := stream.read(most):
            name = f"{stem}{len(parts):03d}.bin"
            (out / name).write_bytes(chunk)
            digest = hashlib.sha256(chunk).hexdigest()
            parts.append({"name": name, "bytes": len(chunk), "sha256": digest})
    return parts


def extract(folder: Path, parts: Sequence[dict[str, Any]], into: Path) -> None:
    """Check every part, then unpack them joined; OfflineError names the first that is damaged."""
    for part in parts:
        path = folder / part["name"]
        if not path.exists():
            raise OfflineError(f"{path} is missing")
        with path.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
        if digest != part["sha256"]:
            raise OfflineError(f"{path} is damaged: copy it again")
    joined = _Joined(folder / part["name"] for part in parts)
    with tarfile.open(fileobj=joined, mode="r|") as tar:
        if hasattr(tarfile, "data_filter"):
            tar.extractall(into, filter="data")
            return
        # before Python 3.11.4 there are no filters: files and folders within `into` alone
        for member in tar:
            path = (into / member.name).resolve()
            inside = path.is_relative_to(into.resolve())
            if not inside or not (member.isfile() or member.isdir() or _stays(member, into)):
                raise OfflineError(f"{folder}: {member.name} would be written outside {into}")
            tar.extract(member, into)


def _stays(member: tarfile.TarInfo, into: Path) -> bool:
    """Whether a symbolic link points to something within `into`."""
    target = (into / member.name).parent / member.linkname
    return member.issym() and target.resolve().is_relative_to(into.resolve())


class _Joined(io.RawIOBase):
    """Files read one after the other."""

    def __init__(self, paths: Iterable[Path]) -> None:
        self._paths: Iterator[Path] = iter(paths)
        self._open: IO[bytes] | None = None

    def readable(self) -> bool:
        return True

    def read(self, size: int = -1) -> bytes:
        found = b""
        while size < 0 or len(found) < size:
            if self._open is None:
                path = next(self._paths, None)
                if path is None:
                    break
                self._open = path.open("rb")
            more = self._open.read(size - len(found) if size >= 0 else -1)
            if not more:
                self._open.close()
                self._open = None
            found += more
        return found


def _requirements(extras: Sequence[str]) -> list[str]:
    """What the package and its extras ask for."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    known = project["optional-dependencies"]
    for extra in extras:
        if extra not in known:
            raise OfflineError(f"--extra {extra}: choose of {', '.join(sorted(known))}")
    return [*project["dependencies"], *(r for extra in extras for r in known[extra])]


def _download(requirements: Sequence[str], wheels: Path, python: str) -> None:
    """Wheels of the requirements and of what they need, for that Python on Linux."""
    wheels.mkdir()
    if not requirements:
        return
    words = [sys.executable, "-m", "pip", "download", "-q", "--disable-pip-version-check"]
    words += ["--only-binary=:all:", "--implementation", "cp", "--python-version", python]
    for platform in _PLATFORMS:
        words += ["--platform", platform]
    constraints = ROOT / "constraints.txt"
    words += ["-c", str(constraints)] if constraints.exists() else []
    _call([*words, "-d", str(wheels), *requirements])


def _lighten(wheel: Path) -> None:
    """Take the compiler of warp's CPU device out of its wheel."""
    light = wheel.with_suffix(".light")
    with (
        zipfile.ZipFile(wheel) as whole,
        zipfile.ZipFile(light, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as less,
    ):
        for entry in whole.infolist():
            if entry.filename == _CPU_COMPILER:
                continue
            content = whole.read(entry)
            if entry.filename.endswith(".dist-info/RECORD"):
                lines = content.decode().splitlines(keepends=True)
                content = "".join(x for x in lines if not x.startswith(_CPU_COMPILER)).encode()
            less.writestr(entry.filename, content)
    light.rename(wheel)


def _add_repository(tar: tarfile.TarFile) -> None:
    """The files of the commit that is checked out, as `repository/`."""
    words = ["git", "-C", str(ROOT), "archive", "--prefix=repository/", "HEAD"]
    archive = subprocess.run(words, capture_output=True, check=True).stdout
    with tarfile.open(fileobj=io.BytesIO(archive)) as source:
        for member in source.getmembers():
            tar.addfile(member, source.extractfile(member) if member.isfile() else None)


def _named(word: str) -> tuple[str, Path]:
    name, _, text = word.partition("=")
    path = Path(text).expanduser()
    if not name or not text or not path.exists() or not re.fullmatch(r"[\w.-]+", name):
        raise OfflineError(f"--add {word}: NAME=PATH of a file or folder that exists")
    return name, path


def _name(text: str) -> str:
    """The package of a requirement or of a wheel's file name."""
    if text.endswith(".whl"):
        return text.split("-")[0]
    found = re.match(r"[A-Za-z0-9._-]+", text)
    return found.group() if found else text


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def _read(parts: Path) -> dict[str, Any]:
    try:
        return json.loads((parts / MANIFEST).read_text())
    except (OSError, ValueError) as error:
        raise OfflineError(f"{parts} holds no parts: {error}") from error


def _call(words: Sequence[str], folder: Path | None = None) -> None:
    """Run a program; OfflineError where it fails."""
    environment = dict(os.environ)
    if folder is not None:
        environment["PYTHONPATH"] = os.pathsep.join(
            [str(folder.resolve()), *filter(None, [environment.get("PYTHONPATH")])]
        )
    done = subprocess.run(words, cwd=folder, env=environment)
    if done.returncode:
        raise OfflineError(f"{' '.join(map(str, words[:6]))} ... ended with {done.returncode}")


def _words(text: str) -> list[str]:
    return [word for word in text.split(",") if word]


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(prog="offline", description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    verb = verbs.add_parser("pack", help="write the parts")
    verb.add_argument("out", type=Path)
    verb.add_argument("--part-mb", type=float, default=60)
    verb.add_argument("--python", default="3.12", help="of the machine")
    verb.add_argument(
        "--have", type=_words, default=[], help="packages that are there: torch,numpy"
    )
    verb.add_argument("--without", type=_words, default=[], help="packages to leave out: ray")
    verb.add_argument("--extra", action="append", default=[], help="of the package: warp")
    verb.add_argument("--add", action="append", default=[], help="NAME=PATH, clips or a run")
    verb.add_argument("--slim", action="store_true", help="warp without its CPU compiler")
    verb = verbs.add_parser("unpack", help="join and install the parts")
    verb.add_argument("parts", type=Path)
    verb.add_argument("--into", type=Path, required=True)
    verb.add_argument(
        "--target", type=Path, help="a folder for PYTHONPATH instead of an environment"
    )
    verb = verbs.add_parser("train", help="train, evaluate, and leave both in parts")
    verb.add_argument("task")
    verb.add_argument("--here", type=Path, required=True, help="what unpack made")
    verb.add_argument("--minutes", type=float, required=True)
    verb.add_argument("--out", type=Path, required=True)
    verb.add_argument("--init", help="a name that was packed, or a path")
    verb.add_argument("--trials", type=int, default=256)
    verb = verbs.add_parser("join", help="the run of those parts, to resume")
    verb.add_argument("parts", type=Path)
    verb.add_argument("--into", type=Path, required=True)
    given, flags = parser.parse_known_args(arguments)
    if flags and given.verb != "train":
        parser.error(f"unknown: {' '.join(flags)}")
    try:
        if given.verb == "pack":
            found = pack(
                given.out,
                part_mb=given.part_mb,
                python=given.python,
                have=given.have,
                without=given.without,
                extras=given.extra,
                add=given.add,
                slim=given.slim,
            )
            size = sum(part["bytes"] for part in found["parts"]) / _MB
            count = len(found["wheels"])
            print(f"{len(found['parts'])} parts, {size:.0f} MB, {count} wheels in {given.out}")
        elif given.verb == "unpack":
            python = unpack(given.parts, given.into, given.target)
            print(f"run it with {python} -m console, in {given.into / 'repository'}")
        elif given.verb == "train":
            flags = [flag for flag in flags if flag != "--"]
            size = train(
                given.task, given.here, given.minutes, given.out, given.init, given.trials, flags
            )
            print(f"{size / _MB:.1f} MB in {given.out}")
        else:
            print(f"inhabit train --run {join(given.parts, given.into)} --resume goes on")
    except (OfflineError, OSError, subprocess.CalledProcessError) as error:
        print(f"offline: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
