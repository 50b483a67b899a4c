"""Parts for a machine without network: packed, checked, installed, trained in, brought back."""

import importlib.util
import json
import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path
from types import ModuleType

import pytest
import torch

from policy.checkpoints.format import Layout, Manifest, read, write
from policy.checkpoints.trimmed import trim, trimmed
from policy.errors import CheckpointError
from tests.support.paths import ROOT


def _load() -> ModuleType:
    spec = importlib.util.spec_from_file_location("offline", ROOT / "deploy" / "offline.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


offline = _load()
PYTHON = "{}.{}".format(*sys.version_info[:2])


def wheel(folder: Path, name: str, extra: dict[str, str] | None = None) -> Path:
    """A wheel with one module that knows its name."""
    files = {
        f"{name}/__init__.py": f"NAME = {name!r}\n",
        f"{name}-1.0.dist-info/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n",
        f"{name}-1.0.dist-info/WHEEL": "Wheel-Version: 1.0\nTag: py3-none-any\n",
        **(extra or {}),
    }
    record = f"{name}-1.0.dist-info/RECORD"
    files[record] = "".join(f"{path},,\n" for path in (*files, record))
    path = folder / f"{name}-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for file, text in files.items():
            archive.writestr(file, text)
    return path


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Packed from three tiny wheels, of which one is left out, and a folder of data."""
    folder = tmp_path_factory.mktemp("offline")
    made = [str(wheel(folder, name)) for name in ("tiny_one", "tiny_two", "ray")]
    clips = folder / "clips"
    clips.mkdir()
    (clips / "walk.npz").write_bytes(b"clip")
    patch = pytest.MonkeyPatch()

    def copied(requirements: list[str], wheels: Path, python: str) -> None:
        """In place of pip's download, which needs a network."""
        assert python == PYTHON
        wheels.mkdir()
        for path in requirements:
            (wheels / Path(path).name).write_bytes(Path(path).read_bytes())

    patch.setattr(offline, "_download", copied)
    offline.pack(
        folder / "parts",
        part_mb=4,
        python=PYTHON,
        without=["ray"],
        add=[f"motions={clips}"],
        requirements=made,
    )
    patch.undo()
    return folder / "parts"


def test_parts_are_small_and_listed_with_their_digests(parts: Path) -> None:
    manifest = json.loads((parts / "manifest.json").read_text())
    assert [name.split("-")[0] for name in manifest["wheels"]] == ["tiny_one", "tiny_two"]
    assert len(manifest["parts"]) > 1
    for part in manifest["parts"]:
        assert (parts / part["name"]).stat().st_size == part["bytes"] <= 4_000_000
    assert (parts / "offline.py").read_bytes() == (ROOT / "deploy" / "offline.py").read_bytes()


def test_unpacked_they_are_installed_in_a_fresh_environment(parts: Path, tmp_path: Path) -> None:
    python = offline.unpack(parts, tmp_path / "here", system=False)
    code = "import tiny_one, tiny_two, world.errors; print(tiny_two.NAME, world.errors.__file__)"
    said = subprocess.run(
        [python, "-I", "-c", code], capture_output=True, text=True, check=True
    ).stdout
    assert said.split() == ["tiny_two", str(tmp_path / "here/repository/world/errors.py")]
    assert (tmp_path / "here/data/motions/walk.npz").read_bytes() == b"clip"
    with pytest.raises(offline.OfflineError, match="is not empty"):
        offline.unpack(parts, tmp_path / "here")


def test_the_environment_sees_what_the_machine_has(parts: Path, tmp_path: Path) -> None:
    python = offline.unpack(parts, tmp_path / "here")
    code = "import tiny_one, torch; print(torch.__version__)"
    said = subprocess.run([python, "-I", "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == torch.__version__


def test_a_folder_for_pythonpath_instead(parts: Path, tmp_path: Path) -> None:
    offline.unpack(parts, tmp_path / "here", target=tmp_path / "site")
    assert (tmp_path / "site/tiny_one/__init__.py").exists()


@pytest.mark.parametrize("fault", ["damaged", "missing"])
def test_a_bad_part_is_named_and_nothing_is_installed(
    fault: str, parts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "parts"
    copy.mkdir()
    for path in parts.iterdir():
        (copy / path.name).write_bytes(path.read_bytes())
    bad = copy / "part001.bin"
    if fault == "missing":
        bad.unlink()
    else:
        content = bytearray(bad.read_bytes())
        content[100] ^= 1
        bad.write_bytes(bytes(content))
    assert offline.main(["unpack", str(copy), "--into", str(tmp_path / "here")]) == 1
    assert f"part001.bin is {fault}" in capsys.readouterr().err
    assert not list((tmp_path / "here").iterdir())


def test_another_python_and_unknown_words_are_refused(
    parts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "parts"
    copy.mkdir()
    manifest = json.loads((parts / "manifest.json").read_text()) | {"python": "2.7"}
    (copy / "manifest.json").write_text(json.dumps(manifest))
    assert offline.main(["unpack", str(copy), "--into", str(tmp_path / "x")]) == 1
    assert "is for Python 2.7, this is" in capsys.readouterr().err
    for words, said in (
        (["--extra", "gpu"], "--extra gpu: choose of"),
        (["--add", "clips"], "NAME=PATH"),
    ):
        assert offline.main(["pack", str(tmp_path / "out"), *words]) == 1
        assert said in capsys.readouterr().err


def test_names_of_packages() -> None:
    assert offline._name("ray[default]>=2.60,<3") == "ray"
    assert offline._name("mujoco>=3.17,!=4.0.0") == "mujoco"
    assert (
        offline._name("grpcio_health_checking-1.85.1-py3-none-any.whl") == "grpcio_health_checking"
    )
    assert offline._normal("grpcio_health_checking") == offline._normal("grpcio-health-checking")


def test_warp_without_its_cpu_compiler_is_still_a_wheel(tmp_path: Path) -> None:
    path = wheel(tmp_path, "warp_lang", {"warp/bin/warp-clang.so": "x", "warp/bin/warp.so": "y"})
    offline._lighten(path)
    with zipfile.ZipFile(path) as light:
        names = light.namelist()
        record = light.read("warp_lang-1.0.dist-info/RECORD").decode()
    assert "warp/bin/warp.so" in names and "warp/bin/warp-clang.so" not in names
    assert "clang" not in record and "warp/bin/warp.so" in record


def state(rows: int) -> dict:
    return {
        "policy": {"actor": {"w": torch.ones(100)}},
        "training": {"learner": {"samples": 7}, "fleet": {"physics": torch.ones(10_000)}},
        "style": {
            "replay": torch.arange(4.0 * rows).view(rows, 4),
            "counters/replay": torch.tensor(rows),
        },
    }


def test_a_trimmed_checkpoint_has_no_scenes_and_as_much_replay_as_fits(tmp_path: Path) -> None:
    found = trimmed(state(1000), 3_000)
    assert "fleet" not in found["training"] and found["training"]["learner"] == {"samples": 7}
    kept = int(found["style"]["counters/replay"])
    assert 100 < kept < 170 and found["style"]["replay"].shape == (kept, 4)
    assert int(trimmed(state(10), 3_000)["style"]["counters/replay"]) == 10
    with pytest.raises(CheckpointError, match="networks and their optimisers alone"):
        trimmed(state(10), 300)
    layout = Layout("sit", (("s", 1),), (("g", 1),), 1, (2,))
    write(tmp_path / "checkpoints" / "latest", state(1000), Manifest(layout, 3, 7))
    again = read(trim(tmp_path, 0.003))
    assert torch.equal(again.state["style"]["replay"], found["style"]["replay"])
    assert again.manifest.iteration == 3


def test_what_was_left_in_parts_is_a_run_again(tmp_path: Path) -> None:
    """As `train` leaves it, but for the training itself."""
    run, out = tmp_path / "run", tmp_path / "out"
    layout = Layout("sit", (("s", 1),), (("g", 1),), 1, (2,))
    write(run / "checkpoints" / "latest", state(1000), Manifest(layout, 42, 7))
    trim(run, 1.0)
    (run / "config.json").write_text("{}")
    out.mkdir()
    (out / "evaluation.json").write_text("{}")
    payload = tmp_path / "run.tar"
    with tarfile.open(payload, "w") as tar:
        tar.add(run / "trimmed", "checkpoints/trimmed")
        tar.add(run / "config.json", "config.json")
    parts = offline.cut(payload, out, "run", 5_000)
    assert len(parts) > 2
    (out / "manifest.json").write_text(json.dumps({"task": "sit", "parts": parts}))
    back = offline.join(out, tmp_path / "back")
    found = read(back / "checkpoints" / "latest")
    assert found.manifest.iteration == 42 and found.path.name == "latest"
    assert (back / "checkpoints/000042").is_dir() and (back / "tensorboard").is_dir()
    assert (back / "evaluations/there.json").exists()


def test_training_needs_no_ray(tmp_path: Path) -> None:
    """The whole command with Ray's import refused, its workers' processes too."""
    (tmp_path / "ray.py").write_text("raise ImportError('no ray here')\n")
    words = ["train", "sit", "--run", str(tmp_path / "run"), "--iterations", "1"]
    words += ["--scenes", "32", "--block", "16", "--actors", "2", "--clone-passes", "0"]
    words += ["--world.pieces", "2", "--world.scales", "1"]

    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    done = subprocess.run(
        [sys.executable, "-m", "console", *words],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run/checkpoints/latest").exists()


@pytest.mark.parametrize("filters", [True, False])
@pytest.mark.parametrize(
    ("name", "kind", "to"),
    [
        ("../outside", tarfile.REGTYPE, ""),
        ("link", tarfile.SYMTYPE, "../../outside"),
        ("device", tarfile.CHRTYPE, ""),
    ],
)
def test_nothing_is_written_outside_also_by_a_python_without_filters(
    filters: bool, name: str, kind: bytes, to: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python 3.11.2, which some systems still have, knows no extraction filters."""
    if not filters:
        monkeypatch.delattr(tarfile, "data_filter", raising=False)
    payload, here = tmp_path / "payload.tar", tmp_path / "in" / "here"
    with tarfile.open(payload, "w") as tar:
        for path, link in (("repository/a.py", ""), ("repository/b.py", "a.py")):
            member = tarfile.TarInfo(path)
            member.type = tarfile.SYMTYPE if link else tarfile.REGTYPE
            member.linkname = link
            tar.addfile(member)
        safe = tmp_path / "safe.tar"
        tar.fileobj.flush()
        safe.write_bytes(payload.read_bytes())
        member = tarfile.TarInfo(name)
        member.type, member.linkname = kind, to
        tar.addfile(member)
    for path, good in ((safe, True), (payload, False)):
        (tmp_path / path.stem).mkdir()
        parts = offline.cut(path, tmp_path / path.stem, "part", 10_000_000)
        here.mkdir(parents=True)
        if good:
            offline.extract(tmp_path / path.stem, parts, here)
            assert (here / "repository" / "b.py").readlink() == Path("a.py")
            here.rename(tmp_path / "first")
        else:
            with pytest.raises((offline.OfflineError, OSError, tarfile.TarError)):
                offline.extract(tmp_path / path.stem, parts, here)
    assert not list(tmp_path.rglob("outside"))
