"""What goes wrong around a training: a full disk, a service that is away; and how it is stopped."""

import itertools
import json
import os
import resource
import select
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

from console.app import exit_code, main, one_line
from console.run.metrics import read_metrics
from discriminator.client import StyleClient
from policy.checkpoints.format import read
from rpc.channel import ChannelConfig
from rpc.errors import UnreachableError
from tests.support import small_clips
from tests.support.paths import ROOT

#: More than the metrics of a few iterations, less than a checkpoint (about 1 MB here).
LITTLE = 200_000


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Flags of a training of a fraction of a second an iteration: 64 samples each."""
    clips = small_clips.write(tmp_path_factory.mktemp("clips"))
    return [
        "--motions", str(clips), "--scenes", "16", "--block", "16", "--horizon", "4",
        "--world.pieces", "2", "--world.scales", "1", "--ppo.hidden", "32", "16",
        "--style.hidden", "32", "16", "--style.batch", "32", "--style.penalty-batch", "16",
        "--style.normaliser-samples", "500", "--style.replay", "1000", "--clone-passes", "0",
        "--threads", "1",
    ]  # fmt: skip


@pytest.fixture(scope="module")
def begun(small: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two iterations."""
    run = tmp_path_factory.mktemp("runs") / "begun"
    assert main(["train", "sit", "--run", str(run), "--iterations", "2", *small]) == 0
    return run


def error_line(capsys: pytest.CaptureFixture[str]) -> str:
    """The error, which must be one line; what the run said of itself before is no error."""
    text = capsys.readouterr().err
    errors = [line for line in text.splitlines() if line.startswith("inhabit: ")]
    assert len(errors) == 1 and "Traceback" not in text, text
    return errors[0]


def goes_on(run: Path) -> None:
    """The checkpoint from before the failure is whole, and the run goes on from it."""
    checkpoints = run / "checkpoints"
    assert sorted(p.name for p in checkpoints.iterdir()) == ["000002", "best", "latest"]
    assert read(checkpoints / "latest").manifest.iteration == 2
    assert main(["train", "sit", "--run", str(run), "--resume", "--iterations", "3"]) == 0
    assert read(checkpoints / "latest").manifest.iteration == 3
    assert [line["iteration"] for line in read_metrics(run / "metrics.jsonl")] == [1, 2, 3]


@contextmanager
def files_no_larger_than(size: int) -> Iterator[None]:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_checkpoint_that_cannot_be_written(
    begun: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    shutil.copytree(begun, run, symlinks=True)
    capsys.readouterr()
    with files_no_larger_than(LITTLE):
        assert main(["train", "sit", "--run", str(run), "--resume", "--iterations", "3"]) == 1
    said = error_line(capsys)
    assert "cannot write checkpoint" in said and "free some space" in said
    goes_on(run)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 8 MB of its own; only root may make one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=8m", "tmpfs", str(disk)]
    if not shutil.which("mount") or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("mounting a small file system is not permitted here")
    yield disk
    subprocess.run(["umount", "--lazy", str(disk)], check=True)


def test_a_restart_that_cannot_begin_leaves_the_run_as_it_was(
    begun: Path, small: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "run"
    shutil.copytree(begun, copy, symlinks=True)
    others = [word if word != small[1] else str(tmp_path / "nowhere") for word in small]
    assert main(["train", "sit", "--run", str(copy), "--restart", *others]) == 2
    assert "nowhere" in error_line(capsys)
    itself = ["--init", str(copy), "--iterations", "1"]
    assert main(["train", "sit", "--run", str(copy), "--restart", *itself, *small]) == 1
    assert "which --restart erases" in error_line(capsys)
    goes_on(copy)


@pytest.mark.parametrize(
    ("left", "unwritten"), [(LITTLE, "checkpoint"), (8192, "run"), (4096, "run"), (0, "metrics")]
)
def test_disk_full(
    left: int,
    unwritten: str,
    begun: Path,
    small_disk: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    run = small_disk / "run"
    shutil.copytree(begun, run, symlinks=True)
    capsys.readouterr()
    ballast = small_disk / "ballast"
    ballast.write_bytes(bytes(shutil.disk_usage(small_disk).free - left))
    # So many that metrics alone would fill what is left, if the checkpoint did not.
    asked = ["train", "sit", "--run", str(run), "--resume", "--iterations", "100"]
    code, said = main([*asked, "--checkpoint-every", "50"]), error_line(capsys)
    assert code == 1
    assert "cannot write" in said and unwritten in said and "No space left on device" in said
    ballast.unlink()
    goes_on(run)


def test_service_unreachable() -> None:
    said: list[str] = []
    with pytest.raises(UnreachableError) as caught:
        StyleClient(ChannelConfig("127.0.0.1:1", retry_s=0.5), said.append)
    assert exit_code(caught.value) == 1
    text = one_line(caught.value)
    assert text.startswith("style service at 127.0.0.1:1 did not answer for ")
    assert "start it" in text and "\n" not in text
    assert len(said) == 1 and "waiting up to 0.5 s" in said[0]


def test_stops_after_so_many_samples(small: list[str], tmp_path: Path) -> None:
    run = tmp_path / "run"
    assert main(["train", "sit", "--run", str(run), "--samples", "150", *small]) == 0
    assert [line["samples"] for line in read_metrics(run / "metrics.jsonl")] == [64, 128, 192]
    assert read(run / "checkpoints" / "latest", ()).manifest.samples == 192


def test_stops_after_so_much_time(
    small: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a clock on which a minute passes whenever the training looks at it."""
    minutes = itertools.count()
    clock = SimpleNamespace(monotonic=lambda: 60.0 * next(minutes), perf_counter=lambda: 0.0)
    monkeypatch.setattr("console.training.command.time", clock)
    run = tmp_path / "run"
    assert main(["train", "sit", "--run", str(run), "--minutes", "3", *small]) == 0
    # It looks before each iteration: after one minute, two, and three, which is the limit.
    assert len(read_metrics(run / "metrics.jsonl")) == 2
    assert read(run / "checkpoints" / "latest", ()).manifest.iteration == 2


def test_standalone_style_service(begun: Path) -> None:
    command = [sys.executable, "-m", "console", "style", str(begun), "--listen", "127.0.0.1:0"]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=environment) as process:
        try:
            assert process.stdout is not None
            assert select.select([process.stdout], [], [], 120)[0], "it must say where it serves"
            line = process.stdout.readline()
            assert line.endswith(", version 2\n"), process.communicate(timeout=10)
            client = StyleClient(ChannelConfig(line.split(" at ")[1].split(",")[0], retry_s=20))
            status = client.status()
            client.close()
            assert (status.version, status.batches, status.width) == (2, 2, 114)
            assert json.loads(status.config)["hidden"] == [32, 16]
            process.send_signal(signal.SIGTERM)
            rest, errors = process.communicate(timeout=30)
            assert process.returncode == 0 and not rest
            # signs of life may come before, on a busy machine
            *before, last = errors.splitlines()
            assert last == "stopping: calls in progress have 10 s to end; Ctrl-C stops at once"
            assert all(line.startswith("inhabit style: ") for line in before), errors
        finally:
            process.kill()
