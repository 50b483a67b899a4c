"""The discriminator service in a process of its own, restarted if it dies.

`python -m discriminator.process` reads one JSON document, a ServiceSpec, from its first line of
standard input, imports, reads the clips, and forks the process that serves. That prints one line
`{"address": ..., "pid": ...}` or `{"error": ...}`, and serves until SIGTERM or the end of standard
input, so that it never outlives the process that started it. If it dies, `{"ended": status}`
follows, and a line on standard input asks for another: a fork takes none of the seconds of a start.
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
from discriminator.protocols import MocapSampler
from discriminator.service import ServiceConfig, start
from discriminator.trainer import Discriminator
from rpc.errors import RpcError
from rpc.server import ServerConfig
from world.errors import InhabitError

START_S = 120.0  # importing torch and reading the clips, on a slow disk
LIVES = 3  # deaths within WINDOW_S that are a crash loop
WINDOW_S = 60.0


@dataclass(frozen=True)
class ServiceSpec:
    """All that the service's process needs; JSON-able."""

    mocap: str
    """`module:function` that makes the MocapSampler in that process."""
    arguments: dict[str, Any] = field(default_factory=dict)
    """Its keyword arguments, JSON-able."""
    style: StyleConfig = StyleConfig()
    seed: int = 0
    object_mask: list[bool] | None = None
    """Features that describe the object; needed where `style.object_features` is off."""
    server: ServerConfig = ServerConfig()
    service: ServiceConfig = ServiceConfig()

    def to_json(self) -> str:
        """One line."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(text: str) -> "ServiceSpec":
        """What `to_json` gave."""
        spec = json.loads(text)
        spec["style"]["hidden"] = tuple(spec["style"]["hidden"])
        spec["style"] = StyleConfig(**spec["style"])
        spec["server"] = ServerConfig(**spec["server"])
        spec["service"] = ServiceConfig(**spec["service"])
        return ServiceSpec(**spec)


def build(spec: ServiceSpec) -> tuple[Discriminator, Journal | None]:
    """The discriminator of a spec and its journal; InhabitError if something does not fit."""
    journal = Journal(Path(spec.service.state)) if spec.service.state else None
    mask = None if spec.object_mask is None else torch.tensor(spec.object_mask)
    style = Discriminator(
        spec.style, _mocap(spec), spec.seed, mask, journal.replay if journal else None
    )
    return style, journal


class StyleProcess:
    """A running service; `address` is where. A dead one is started again, at the same address."""

    def __init__(self, spec: ServiceSpec, report: Callable[[str], None] | None = None) -> None:
        """Start and wait until it serves.

        report: gets one line for every restart.
        Raises StyleError with the service's own line if it cannot start.
        """
        self._report = report or (lambda line: None)
        self._stopping = threading.Event()
        #: Why there will be no next life; None as long as there is hope.
        self.lost: str | None = None
        self._keeper, life = _spawn(spec)
        self.pid: int = life["pid"]
        """Of the current life."""
        self.address: str = life["address"]
        # Clients know the address: the next life must have the same.
        self._spec = replace(spec, server=replace(spec.server, listen=self.address))
        self._watch = threading.Thread(target=self._keep_alive, daemon=True)
        self._watch.start()

    @property
    def keeper(self) -> int:
        """Process id of what the lives are forked from."""
        return self._keeper.pid

    def stop(self) -> None:
        """Drain and end it."""
        self._stopping.set()
        keeper = self._keeper
        with contextlib.suppress(ProcessLookupError):
            os.killpg(keeper.pid, signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            keeper.wait(self._spec.server.drain_s + 5)
        _kill(keeper)
        self._watch.join(WINDOW_S)
        _close(keeper)

    def _keep_alive(self) -> None:
        deaths: list[float] = []
        while True:
            code = _ended(self._keeper)
            if self._stopping.is_set():
                return
            now = time.monotonic()
            deaths = [t for t in deaths if now - t < WINDOW_S] + [now]
            if len(deaths) >= LIVES:
                self.lost = f"style service: ended {LIVES} times in a minute (status {code})"
                _kill(self._keeper)
                return
            self._report(f"style service ended (status {code}): starting it again")
            try:
                self.pid = self._again()["pid"]
            except StyleError as error:
                self.lost = f"style service: does not start again: {error}"
                return
            if self._stopping.is_set():  # stop() saw the former life
                self._keeper.terminate()

    def _again(self) -> dict[str, Any]:
        """Another life: forked, or started anew where the keeper has ended too."""
        keeper = self._keeper
        if keeper.poll() is None:
            with contextlib.suppress(_Silent):
                return _asked(keeper, self._spec)
        _kill(keeper)  # a life of it may be there still, and hold the port
        _close(keeper)
        self._keeper, life = _spawn(self._spec)
        return life


def start_process(spec: ServiceSpec, report: Callable[[str], None] | None = None) -> StyleProcess:
    """See StyleProcess."""
    return StyleProcess(spec, report)


class _Silent(StyleError):
    """It ended, or said nothing for START_S, instead of serving."""


def _spawn(spec: ServiceSpec) -> tuple[subprocess.Popen[str], dict[str, Any]]:
    """A started keeper and its first life; StyleError if it ends, or is silent, instead."""
    environment = dict(os.environ, OMP_NUM_THREADS="1", CUDA_VISIBLE_DEVICES="")
    environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    keeper = subprocess.Popen(
        [sys.executable, "-m", "discriminator.process"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
        start_new_session=True,  # Ctrl-C is for the training, which then ends the service
    )
    return keeper, _asked(keeper, spec)


def _asked(keeper: subprocess.Popen[str], spec: ServiceSpec) -> dict[str, Any]:
    """Ask for a life of a spec, and wait for it; StyleError with its line if it cannot serve."""
    assert keeper.stdin is not None and keeper.stdout is not None
    silent = threading.Timer(START_S, os.killpg, (keeper.pid, signal.SIGKILL))
    silent.start()
    try:
        keeper.stdin.write(spec.to_json() + "\n")
        keeper.stdin.flush()
        line = keeper.stdout.readline()
    except BrokenPipeError:
        line = ""
    finally:
        silent.cancel()
    with contextlib.suppress(ValueError):
        answer = json.loads(line)
        if "address" in answer:
            return answer
        if "error" in answer:
            _kill(keeper)
            _close(keeper)
            raise StyleError(f"style service: {answer['error']}")
    status = keeper.poll()
    _kill(keeper)
    _close(keeper)
    raise _Silent(f"style service: ended before it served (status {status})")


def _ended(keeper: subprocess.Popen[str]) -> int:
    """Waits for the end of the life that serves; its exit status, or the keeper's own."""
    assert keeper.stdout is not None
    with contextlib.suppress(ValueError):  # also where the pipe was closed meanwhile
        return int(json.loads(keeper.stdout.readline())["ended"])
    return keeper.wait()


def _kill(keeper: subprocess.Popen[str]) -> None:
    """End a keeper and its life: a group of their own."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(keeper.pid, signal.SIGKILL)
    keeper.wait()


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
    """The keeper; 0 after a drain, 1 with one line of JSON if it cannot serve."""
    torch.set_num_threads(1)
    spec = ServiceSpec.from_json(sys.stdin.readline())
    try:
        style, journal = build(spec)
    except (InhabitError, RpcError) as error:
        print(json.dumps({"error": str(error)}), flush=True)
        return 1
    life = 0

    def stop(*_: Any) -> None:
        if not life:
            os._exit(0)
        with contextlib.suppress(ProcessLookupError):
            os.kill(life, signal.SIGTERM)

    while True:
        # Neither torch nor gRPC has begun a thread in this process: forking it is safe.
        life = os.fork()
        if not life:
            return serve(style, spec, journal)
        signal.signal(signal.SIGTERM, stop)
        status = os.waitstatus_to_exitcode(os.waitpid(life, 0)[1])
        life = 0
        if not status:
            return 0
        print(json.dumps({"ended": status}), flush=True)
        line = sys.stdin.readline()
        if not line:
            return status
        spec = ServiceSpec.from_json(line)


def serve(style: Discriminator, spec: ServiceSpec, journal: Journal | None) -> int:
    """One life, from where the journal has it; 0 after a drain, 1 if it cannot serve."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # no longer the keeper's
    try:
        server = start(style, spec.server, spec.service, journal)
    except (InhabitError, RpcError) as error:
        print(json.dumps({"error": str(error)}), flush=True)
        return 1
    print(json.dumps({"address": server.address, "pid": os.getpid()}), flush=True)

    def orphaned() -> None:
        sys.stdin.read()
        server.stopping.set()

    threading.Thread(target=orphaned, daemon=True).start()
    server.run()
    return 0


if __name__ == "__main__":
    # A daemon thread may hold standard input: no interpreter shutdown, which would trip on it.
    status = main()
    sys.stdout.flush()
    os._exit(status)
