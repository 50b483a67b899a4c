"""A private Ray is its own and listens to no other machine: every socket of it is local."""

import functools
import os
import re
import signal
import sys
import time
from pathlib import Path
from subprocess import Popen, run
from typing import Any

import pytest
import ray
from ray._private import services

from actors import cluster
from actors.cluster import ClusterError, ray_session
from console.run.machine import process_tree
from tests.support.paths import ROOT
from tests.support.rpc.sockets import listening


def process() -> int:
    return os.getpid()


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs Linux's /proc")
def test_every_port_is_on_the_loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("RAY_ADDRESS", raising=False)
    # Where `ray start` leaves the address of a cluster of this machine: ours must not join it.
    monkeypatch.setattr("ray._private.utils.read_ray_address", lambda *_: "127.0.0.1:1")
    before = process_tree()
    with ray_session(cpus=1, object_store_bytes=80 * 2**20):
        assert ray.get(ray.remote(process).remote()) in process_tree()
        addresses = listening(process_tree() - before | {os.getpid()})
        assert len(addresses) >= 5, "the control store, the node's two ports, agents, a worker"
        assert [a for a in addresses if not a.is_loopback] == []
    assert "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER" not in os.environ


def test_a_long_name_of_the_temporary_folder_is_left_for_the_sockets(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("RAY_TMPDIR", raising=False)
    monkeypatch.setenv("TMPDIR", str(tmp_path / ("x" * 100)))
    with cluster._short_session():
        assert os.environ["RAY_TMPDIR"] == "/tmp"
    assert "RAY_TMPDIR" not in os.environ
    monkeypatch.setenv("TMPDIR", "/tmp")
    with cluster._short_session():
        assert "RAY_TMPDIR" not in os.environ


#: Seconds; Ray's node waits 15 for agents that choose their own ports.
SLOWLY = 17
SLOW_AGENTS = f"""
import os, pathlib, time
line = open("/proc/self/cmdline").read()
if "dashboard/agent.py" in line or "runtime_env/agent/main.py" in line:
    pathlib.Path(__file__).with_name(f"slow-{{os.getpid()}}").touch()
    time.sleep({SLOWLY})
"""
FORKING = """
import subprocess, sys
from concurrent.futures import ThreadPoolExecutor
from actors.cluster import ray_session
import rpc.channel
import grpc, ray
server = grpc.server(ThreadPoolExecutor(1))
address = f"127.0.0.1:{server.add_insecure_port('127.0.0.1:0')}"
server.start()
with grpc.insecure_channel(address) as channel, ray_session(cpus=1):
    grpc.channel_ready_future(channel).result(30)
    for _ in range(20):
        subprocess.run(["true"], preexec_fn=int, check=True)
    assert ray.get(ray.remote(lambda: 5).remote()) == 5
server.stop(None)
"""


def test_programs_are_started_beside_ray_and_grpc_without_a_word() -> None:
    """gRPC, ready for forks that never come, said "Bad file descriptor" of its poller, or nothing
    at all, and calls were not answered any more."""
    done = run(
        [sys.executable, "-c", FORKING], capture_output=True, text=True, timeout=200, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr
    assert "fork" not in done.stderr and "descriptor" not in done.stderr, done.stderr


DYING = f"""#!{sys.executable}
import sys
path = next(word.partition("=")[2] for word in sys.argv if word.startswith("--stderr_filepath"))
open(path, "w").write("E a line\\n[C 1] a bug. Check failed: no port is free\\n*** Stack")
sys.exit(3)
"""


@pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="needs Linux's /proc")
def test_agents_may_be_slow_to_start(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """As on a busy machine, where they import for so long."""
    (tmp_path / "sitecustomize.py").write_text(SLOW_AGENTS)
    monkeypatch.delenv("RAY_ADDRESS", raising=False)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    began = time.monotonic()
    with ray_session(cpus=1, object_store_bytes=80 * 2**20):
        assert ray.get(ray.remote(process).remote()) in process_tree()
        time.sleep(max(0.0, began + SLOWLY + 3 - time.monotonic()))
        assert ray.get(ray.remote(process).remote()) in process_tree()
    assert len(list(tmp_path.glob("slow-*"))) >= 2, "both agents slept"


def sessions() -> set[str]:
    """Ray's names for the nodes that this process has started, of which a process still runs."""
    found = set()
    for pid in process_tree():
        try:
            line = Path(f"/proc/{pid}/cmdline").read_text()
        except OSError:
            continue  # it has just ended
        found |= set(re.findall(r"/(session_[\d_-]+)", line))
    return found


def sabotaged(
    monkeypatch: pytest.MonkeyPatch, starter: str, signals: list[signal.Signals]
) -> list[Popen[bytes]]:
    """The first processes that Ray's `starter` makes get these signals, one each; all it makes."""
    monkeypatch.delenv("RAY_ADDRESS", raising=False)
    start, made = getattr(services, starter), []

    def start_and_signal(*given: Any, **named: Any) -> Any:
        found = start(*given, **named)
        if len(made) < len(signals):
            found.process.send_signal(signals[len(made)])
        made.append(found.process)
        return found

    # the signature is asked for
    monkeypatch.setattr(services, starter, functools.wraps(start)(start_and_signal))
    return made


@pytest.mark.parametrize("starter", ["start_gcs_server", "start_raylet"])
def test_an_actor_that_dies_at_its_start_is_started_again(
    starter: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The start-up time-out would end after the test's own time-out.
    monkeypatch.setattr("actors.cluster.START_S", 600.0)
    made = sabotaged(monkeypatch, starter, [signal.SIGKILL])
    before = sessions()
    with ray_session(cpus=1, object_store_bytes=80 * 2**20):
        assert ray.get(ray.remote(process).remote()) in process_tree()
        # of the first try nothing is left, its monitors included
        assert len(sessions() - before) == 1
    assert made[0].poll() == -signal.SIGKILL and len(made) == 2


def test_a_store_that_hangs_is_ended_and_started_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("actors.cluster.STORE_S", 3.0)
    made = sabotaged(monkeypatch, "start_gcs_server", [signal.SIGSTOP])
    with ray_session(cpus=1, object_store_bytes=80 * 2**20):
        assert made[0].poll() == -signal.SIGKILL and made[1].poll() is None


def test_the_error_names_the_cause_of_death(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Three times, and what a Ray process writes as it aborts."""
    made = sabotaged(monkeypatch, "start_gcs_server", [])
    monkeypatch.setattr(services, "GCS_SERVER_EXECUTABLE", str(tmp_path / "gcs_server"))
    (tmp_path / "gcs_server").write_text(DYING)
    (tmp_path / "gcs_server").chmod(0o755)
    with (
        pytest.raises(ClusterError, match=r"gcs_server ended .* status 3: no port is free$"),
        ray_session(cpus=1, object_store_bytes=80 * 2**20),
    ):
        pass
    assert [one.poll() for one in made] == [3, 3, 3]


def test_nobody_listens(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is told before Ray is asked, which would try for minutes."""
    monkeypatch.setattr(ray, "init", lambda *_, **__: pytest.fail("Ray was asked"))
    with (
        pytest.raises(ClusterError, match=r"no Ray answers at 127\.0\.0\.1:1 "),
        ray_session(cpus=1, address="127.0.0.1:1"),
    ):
        pass
