"""The discriminator service in a process of its own, restarted if it dies.

`python -m discriminator.process` is the supervisor. It reads a ServiceSpec as JSON from the first
line of standard input, reads the clips, and forks the server process. The server prints one line
`{"address": ..., "pid": ...}` or `{"error": ...}`, and serves until SIGTERM or the end of standard
input, so that it does not outlive the process that started it. If it dies, the supervisor prints
`{"ended": status}`, and forks another server for the next line of standard input: a fork saves the
seconds of a start.
"""

import contextlib
import importlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import torch

from discriminator.config import StyleConfig
from discriminator.errors import StyleError
from discriminator.journal import Journal
from discriminator.protocols import Holding, MocapSampler
from discriminator.service import start
from discriminator.trainer import Discriminator
from rpc.errors import RpcError
from rpc.server import ServerConfig
from world.errors import InhabitError

START_S = 300.0  # time to import torch and read the clips, on a slow disk
MAX_DEATHS = 3  # deaths within WINDOW_S that count as a crash loop
WINDOW_S = 60.0


@dataclass(frozen=True)
class ServiceSpec:
    """Specification of a service process, serialisable as JSON."""

    mocap: str
    """`module:function` that makes the MocapSampler in that process."""
    arguments: dict[str, Any] = field(default_factory=dict)
    """Keyword arguments of that function, serialisable as JSON."""
    style: StyleConfig = StyleConfig()
    seed: int = 0
    object_mask: list[bool] | None = None
    """Features that describe the object; needed where `style.object_features` is off."""
    holding: dict[str, Any] | None = None
    """What `style.mask_holding` hides (Holding.to_json)."""
    coarse: list[bool] | None = None
    """Features that the clips show coarsely (Discriminator)."""
    server: ServerConfig = ServerConfig()
    state: str = ""
    """Directory of the journal from which a killed service continues; empty: none."""

    def to_json(self) -> str:
        """The specification as one line of JSON."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(text: str) -> "ServiceSpec":
        """Specification from JSON."""
        spec = json.loads(text)
        spec["style"]["hidden"] = tuple(spec["style"]["hidden"])
        spec["style"] = StyleConfig(**spec["style"])
        spec["server"] = ServerConfig(**spec["server"])
        return ServiceSpec(**spec)


def build(spec: ServiceSpec) -> tuple[Discriminator, Journal | None]:
    """Discriminator and journal of a specification; InhabitError if something does not fit."""
    journal = Journal(Path(spec.state)) if spec.state else None
    if journal is not None:
        journal.lock()
    mask = None if spec.object_mask is None else torch.tensor(spec.object_mask)
    style = Discriminator(
        spec.style,
        _mocap(spec),
        spec.seed,
        mask,
        journal.replay if journal else None,
        holding=None if spec.holding is None else Holding.from_json(spec.holding),
        coarse=None if spec.coarse is None else torch.tensor(spec.coarse),
    )
    if journal is not None:
        journal.require_rows(style.replay.rows.nbytes)
    return style, journal


class StyleProcess:
    """A running service at `address`; if it dies, it is restarted at the same address."""

    def __init__(self, spec: ServiceSpec, report: Callable[[str], None] | None = None) -> None:
        """Start the service and wait until it serves.

        report: called with one line for every restart.
        Raises StyleError with the service's error line if it cannot start.
        """
        self._report = report or (lambda line: None)
        self._stopping = threading.Event()
        #: Why the service is not restarted any more; None while it may be.
        self.lost: str | None = None
        self._supervisor, reply = _spawn(spec)
        self.pid: int = reply["pid"]
        """Process id of the current server"""
        self.address: str = reply["address"]
        # Clients have this address, so the next server must have it too.
        self._spec = replace(spec, server=replace(spec.server, listen=self.address))
        self._watch = threading.Thread(target=self._keep_alive, daemon=True)
        self._watch.start()

    @property
    def supervisor(self) -> int:
        """Process id of the supervisor, which forks the servers."""
        return self._supervisor.pid

    def stop(self) -> None:
        """Drain and end the service."""
        self._stopping.set()
        supervisor = self._supervisor
        with contextlib.suppress(ProcessLookupError):
            os.killpg(supervisor.pid, signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            supervisor.wait(self._spec.server.drain_s + 5)
        _kill(supervisor)
        self._watch.join(WINDOW_S)
        _close(supervisor)

    def _keep_alive(self) -> None:
        deaths: list[float] = []
        while True:
            code = _wait_for_exit(self._supervisor)
            if self._stopping.is_set():
                return
            now = time.monotonic()
            deaths = [t for t in deaths if now - t < WINDOW_S] + [now]
            if len(deaths) >= MAX_DEATHS:
                self.lost = f"style service: ended {MAX_DEATHS} times in a minute (status {code})"
                _kill(self._supervisor)
                return
            self._report(f"style service ended (status {code}): starting it again")
            try:
                self.pid = self._restart()["pid"]
            except StyleError as error:
                self.lost = f"style service: does not start again: {error}"
                return
            if self._stopping.is_set():  # stop() has signalled the former server only
                self._supervisor.terminate()

    def _restart(self) -> dict[str, Any]:
        """Restart the server, by a fork or, where the supervisor has ended too, from the start."""
        supervisor = self._supervisor
        if supervisor.poll() is None:
            with contextlib.suppress(_NoAnswer):
                return _start_server(supervisor, self._spec)
        _kill(supervisor)  # its server may still run and hold the port
        _close(supervisor)
        self._supervisor, reply = _spawn(self._spec)
        return reply


def start_process(spec: ServiceSpec, report: Callable[[str], None] | None = None) -> StyleProcess:
    """Start a StyleProcess."""
    return StyleProcess(spec, report)


class _NoAnswer(StyleError):
    """The service ended, or sent no answer for START_S, instead of serving."""


def _spawn(spec: ServiceSpec) -> tuple[subprocess.Popen[str], dict[str, Any]]:
    """Start a supervisor; returns it and its first answer; StyleError if it does not serve."""
    environment = dict(os.environ, OMP_NUM_THREADS="1", CUDA_VISIBLE_DEVICES="")
    environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    supervisor = subprocess.Popen(
        [sys.executable, "-m", "discriminator.process"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
        start_new_session=True,  # Ctrl-C must reach the training alone, which ends the service
    )
    return supervisor, _start_server(supervisor, spec)


def _start_server(supervisor: subprocess.Popen[str], spec: ServiceSpec) -> dict[str, Any]:
    """Request a server and wait for its answer; StyleError, with its line, if it cannot serve."""
    assert supervisor.stdin is not None and supervisor.stdout is not None
    late = threading.Event()

    def give_up() -> None:
        late.set()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(supervisor.pid, signal.SIGKILL)

    timer = threading.Timer(START_S, give_up)
    timer.start()
    try:
        supervisor.stdin.write(spec.to_json() + "\n")
        supervisor.stdin.flush()
        line = supervisor.stdout.readline()
    except BrokenPipeError:
        line = ""
    finally:
        timer.cancel()
    with contextlib.suppress(ValueError):
        answer = json.loads(line)
        if "address" in answer:
            return answer
        if "error" in answer:
            _kill(supervisor)
            _close(supervisor)
            raise StyleError(f"style service: {answer['error']}")
    status = supervisor.poll()
    _kill(supervisor)
    _close(supervisor)
    if late.is_set():
        raise _NoAnswer(f"style service: still read its clips after {START_S:g} s, and was ended")
    raise _NoAnswer(f"style service: ended before it served (status {status})")


def _wait_for_exit(supervisor: subprocess.Popen[str]) -> int:
    """Wait for the end of the server; returns its exit status, or the supervisor's."""
    assert supervisor.stdout is not None
    with contextlib.suppress(ValueError):  # also where the pipe was closed meanwhile
        return int(json.loads(supervisor.stdout.readline())["ended"])
    return supervisor.wait()


def _kill(supervisor: subprocess.Popen[str]) -> None:
    """End the process group of a supervisor and its server."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(supervisor.pid, signal.SIGKILL)
    supervisor.wait()


def _close(process: subprocess.Popen[str]) -> None:
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()


def _mocap(spec: ServiceSpec) -> MocapSampler:
    module, colon, name = spec.mocap.partition(":")
    if not colon:
        raise StyleError(f"mocap '{spec.mocap}': must be module:function")
    try:
        factory = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise StyleError(f"mocap '{spec.mocap}': {error}") from error
    return factory(**spec.arguments)


def main() -> int:
    """Run the supervisor; returns 0 after a drain, 1 with one line of JSON if it cannot serve."""
    torch.set_num_threads(1)
    spec = ServiceSpec.from_json(sys.stdin.readline())
    try:
        style, journal = build(spec)
    except (InhabitError, RpcError) as error:
        print(json.dumps({"error": str(error)}), flush=True)
        return 1
    child = 0

    def stop(*_: Any) -> None:
        if not child:
            os._exit(0)
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGTERM)

    while True:
        # Neither torch nor gRPC has a thread in this process, so forking is safe.
        child = os.fork()
        if not child:
            return serve(style, spec, journal)
        signal.signal(signal.SIGTERM, stop)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        child = 0
        if not status:
            return 0
        print(json.dumps({"ended": status}), flush=True)
        line = sys.stdin.readline()
        if not line:
            return status
        spec = ServiceSpec.from_json(line)


def serve(style: Discriminator, spec: ServiceSpec, journal: Journal | None) -> int:
    """Run a server from the journal's state; returns 0 after a drain, 1 if it cannot serve."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # replaces the supervisor's handler
    try:
        server = start(style, spec.server, journal)
    except (InhabitError, RpcError) as error:
        print(json.dumps({"error": str(error)}), flush=True)
        return 1
    print(json.dumps({"address": server.address, "pid": os.getpid()}), flush=True)

    def stop_at_end_of_input() -> None:
        sys.stdin.read()
        server.stopping.set()

    threading.Thread(target=stop_at_end_of_input, daemon=True).start()
    server.run()
    return 0


if __name__ == "__main__":
    # A daemon thread may hold standard input, on which an interpreter shutdown would fail.
    status = main()
    sys.stdout.flush()
    os._exit(status)
