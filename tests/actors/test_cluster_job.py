"""A training submitted to a real `ray start --head`: its log, its exit status, who is let in."""

import json
import os
import re
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from console.run.directory import RunDirectory
from console.run.machine import process_tree
from console.run.metrics import read_metrics
from tests.support import small_clips
from tests.support.paths import ROOT
from tests.support.rpc.sockets import listening

RAY = [sys.executable, "-c", "from ray.scripts.scripts import main; main()"]
SMALL = [
    "--scenes", "16", "--block", "8", "--horizon", "4", "--actors", "2",
    "--world.pieces", "2", "--world.scales", "1", "--ppo.hidden", "32", "16",
    "--style.hidden", "32", "16", "--style.batch", "32", "--style.penalty-batch", "16",
    "--style.normaliser-samples", "500", "--style.replay", "1000", "--clone-passes", "0",
]  # fmt: skip
pytestmark = pytest.mark.timeout(900)


@dataclass
class Cluster:
    """A head on this machine, and what its users need to know."""

    address: str
    dashboard: str
    environment: dict[str, str]
    scratch: Path
    """Ray's own folder."""


def free_ports(count: int) -> list[int]:
    held = [socket.socket() for _ in range(count)]
    for one in held:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in held]
    for one in held:
        one.close()
    return ports


def started(words: list[str], environment: dict[str, str], log: Path) -> subprocess.Popen[bytes]:
    """A `ray start --block` that is up; ended by SIGTERM, with all that it started.

    Ray gives its own processes 30 s to find one another, which a busy machine does not always have
    for them: there is a second try.
    """
    for _ in range(2):
        with log.open("wb") as out:
            process = subprocess.Popen(
                [*RAY, "start", "--block", "--disable-usage-stats", *words],
                env=environment, stdout=out, stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip
        while process.poll() is None and "Ray runtime started" not in log.read_text():
            time.sleep(0.2)
        try:
            process.wait(2)  # it looks after its processes every second
        except subprocess.TimeoutExpired:
            return process
    raise AssertionError(log.read_text())


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    folder = tmp_path_factory.mktemp("cluster")
    token = folder / "token"
    token.write_text(secrets.token_hex(16))
    environment = {k: v for k, v in os.environ.items() if not k.startswith("RAY_")} | {
        "RAY_AUTH_MODE": "token",
        "RAY_AUTH_TOKEN_PATH": str(token),
        "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",  # every port on the loopback, see SECURITY.md
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
    }
    ports = free_ports(7)
    names = (
        "port", "dashboard-port", "ray-client-server-port", "dashboard-agent-listen-port",
        "dashboard-agent-grpc-port", "metrics-export-port", "runtime-env-agent-port",
    )  # fmt: skip
    words = [f"--{name}={port}" for name, port in zip(names, ports, strict=True)]
    words += ["--node-ip-address=127.0.0.1", "--dashboard-host=127.0.0.1", "--num-cpus=2"]
    # Not in the test's own folder: with it, the name of Ray's longest socket may pass the 107
    # characters that a Unix socket has, by how many digits there are in process ids and folders.
    scratch = Path(tempfile.mkdtemp(prefix="ray-", dir="/tmp"))
    words += ["--object-store-memory=80000000", f"--temp-dir={scratch}"]
    head = None
    try:
        head = started(["--head", *words], environment, folder / "head.log")
        dashboard = f"http://127.0.0.1:{ports[1]}"
        yield Cluster(
            f"127.0.0.1:{ports[0]}",
            dashboard,
            environment | {"RAY_API_SERVER_ADDRESS": dashboard},
            scratch,
        )
    finally:
        if head is not None:
            head.send_signal(signal.SIGTERM)
            try:
                head.wait(60)
            except subprocess.TimeoutExpired:
                os.killpg(head.pid, signal.SIGKILL)
        shutil.rmtree(scratch, ignore_errors=True)


def submit(cluster: Cluster, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """deploy/submit.py, from elsewhere than the repository."""
    return subprocess.run(
        [sys.executable, str(ROOT / "deploy" / "submit.py"), *words],
        env=cluster.environment | environment,
        cwd="/",
        capture_output=True,
        text=True,
    )


def test_a_training_streams_its_log_and_ends_with_0(cluster: Cluster, tmp_path: Path) -> None:
    clips, run = small_clips.write(tmp_path / "clips"), tmp_path / "run"
    done = submit(
        cluster, "sit", "--run", str(run), "--iterations", "3", "--motions", str(clips), *SMALL
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"checkpoint 3 in {run}/checkpoints" in done.stdout
    metrics = read_metrics(run / "metrics.jsonl")
    assert [line["iteration"] for line in metrics] == [1, 2, 3]
    assert metrics[-1]["actors/alive"] == 2
    config = json.loads(RunDirectory(run).config.read_text())
    assert "--address" not in config["command"], "a job finds its own cluster"


def ray_job_submit(cluster: Cluster, *words: str) -> subprocess.CompletedProcess[str]:
    """Ray's own command as docs/how-to/cluster.md has it, run in the repository."""
    job = ["python", "-m", "console", "train", *words]
    return subprocess.run(
        [*RAY, "job", "submit", "--working-dir", ".", "--", *job],
        env=cluster.environment, cwd=ROOT, capture_output=True, text=True,
    )  # fmt: skip


def test_ray_s_own_submit_streams_the_log_and_tells_success_from_failure(
    cluster: Cluster, tmp_path: Path
) -> None:
    clips, run = small_clips.write(tmp_path / "clips"), tmp_path / "run"
    words = ("sit", "--runner", "ray", "--iterations", "2", *SMALL)
    done = ray_job_submit(cluster, *words, "--run", str(run), "--motions", str(clips))
    said = done.stdout + done.stderr
    assert done.returncode == 0, said
    # the training's own lines, streamed, and Ray's after them
    assert f"checkpoint 2 in {run}/checkpoints" in said
    assert "succeeded" in said.rpartition("checkpoint 2 in")[2]
    assert [line["iteration"] for line in read_metrics(run / "metrics.jsonl")] == [1, 2]
    # one that cannot begin: its line is streamed, and the status is not 0
    other, nowhere = str(tmp_path / "other"), str(tmp_path / "nowhere")
    failed = ray_job_submit(cluster, *words, "--run", other, "--motions", nowhere)
    said = failed.stdout + failed.stderr
    assert failed.returncode == 1, said
    assert "nowhere" in said and "failed" in said


def test_the_head_listens_to_no_other_machine(cluster: Cluster) -> None:
    addresses = listening(process_tree())
    assert len(addresses) >= 8, "control store, dashboard, node, object manager, agents, client"
    assert [a for a in addresses if not a.is_loopback] == []


def test_a_training_that_fails_gives_its_own_status_and_line(
    cluster: Cluster, tmp_path: Path
) -> None:
    done = submit(cluster, "fly", "--run", str(tmp_path / "run"))
    assert done.returncode == 2
    assert "inhabit: unknown task 'fly': choose one of carry, lie, sit" in done.stdout
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "config.json").write_text("{}")
    done = submit(cluster, "sit", "--run", str(tmp_path / "taken"))
    assert done.returncode == 1
    assert "add --resume or --restart" in done.stdout


def test_the_working_directory_is_small(cluster: Cluster) -> None:
    """What a job uploads: the package, without tests, pictures, environments and history."""
    packed = cluster.scratch.glob("session_latest/runtime_resources/working_dir_files/*")
    folders = [path for path in packed if path.is_dir()]
    assert folders, "a job ran before"
    held = {path.name for path in folders[0].iterdir()}
    assert {"console", "world", "actors"} <= held
    assert not held & {"tests", "docs", "runs", ".git", ".venv", "shared"}
    files = [path for path in folders[0].rglob("*.*") if path.is_file()]
    policies = [path for path in files if "pretrained" in path.parts]
    assert policies, "`--init` may name them"
    assert sum(path.stat().st_size for path in files) < 4e6 + sum(
        path.stat().st_size for path in policies
    )


def test_a_client_without_a_token_is_refused(cluster: Cluster, tmp_path: Path) -> None:
    words = ("sit", "--run", str(tmp_path / "run"))
    other = tmp_path / "token"
    other.write_text(secrets.token_hex(16))
    for environment in ({"RAY_AUTH_MODE": "disabled"}, {"RAY_AUTH_TOKEN_PATH": str(other)}):
        done = submit(cluster, *words, **environment)
        assert done.returncode == 1
        assert re.match(r"submit: http://127\.0\.0\.1:\d+: ", done.stderr), done.stderr
        assert "Traceback" not in done.stderr and not (tmp_path / "run").exists()


def test_a_run_that_the_job_would_take_with_it_is_refused(cluster: Cluster) -> None:
    done = submit(cluster, "sit")
    assert done.returncode == 2
    assert done.stderr.startswith("submit: give --run and a folder that outlives the job")
