"""A Ray session: a private one on this machine, or a cluster that is joined."""

import inspect
import os
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ray
from ray._private import node, ray_constants, services
from ray._raylet import DASHBOARD_AGENT_LISTEN_PORT_NAME, persist_port

from world.errors import InhabitError

# Read at Ray's first call; the reason stands in rpc/__init__.py.
os.environ.setdefault("GRPC_ENABLE_FORK_SUPPORT", "0")

NAMESPACE = "inhabit"
_OPTIONS: dict[str, Any] = {
    "namespace": NAMESPACE,
    "log_to_driver": False,
    "logging_level": "ERROR",
}
_ROOT = str(Path(__file__).resolve().parent.parent)
_AGENT_PORTS = (
    "metrics_agent_port",
    "metrics_export_port",
    "runtime_env_agent_port",
    "dashboard_agent_listen_port",
)
#: Processes that Ray cannot run without; its monitors may end.
_REQUIRED = (ray_constants.PROCESS_TYPE_GCS_SERVER, ray_constants.PROCESS_TYPE_RAYLET)
SESSION_BYTES = 36
"""Greatest length of the folder of a session: its sockets have up to 70 bytes more, of 107."""
START_S = 180.0
"""Longest wait for a node to register, s."""
STORE_S = 60.0
"""Longest wait for the control store's port, s."""


class ClusterError(InhabitError):
    """Ray cannot be started or joined."""


@contextmanager
def ray_session(
    cpus: int, address: str | None = None, object_store_bytes: int = 256 * 2**20
) -> Iterator[None]:
    """Run Ray within a `with`; a Ray that already runs in this process is used and left running.

    address: HOST:PORT or 'auto' joins a cluster. None: the cluster that a submitted job runs in,
    else a private Ray on this machine with `cpus` slots (Ray does not pin cores), without a
    dashboard, on the loopback interface alone.
    Raises ClusterError where Ray cannot be started or joined.
    """
    if ray.is_initialized():
        yield
        return
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    inherited = None if address else os.environ.get("RAY_ADDRESS")
    address = address or inherited
    try:
        if not address:
            _start(cpus, object_store_bytes)
        else:
            require_listener(address, inherited is not None)
            ray.init(address=address, **_OPTIONS)
    except ClusterError:
        raise
    # Ray's own errors of starting and joining have no common base below Exception.
    except Exception as error:
        ray.shutdown()
        where = f"join Ray at {address}" if address else "start Ray on this machine"
        where += " (from RAY_ADDRESS; unset it to use this machine)" if inherited else ""
        reason = next(iter(str(error).strip().splitlines()), type(error).__name__)
        raise ClusterError(f"could not {where}: {reason}") from error
    try:
        yield
    finally:
        ray.shutdown()


def _start(cpus: int, object_store_bytes: int) -> None:
    """Start a private Ray; one that does not come up is ended, and started again, three in all."""
    for last in (False, False, True):
        with (
            _importable(),
            _short_session(),
            on_loopback(),
            _agents_with_ports(),
            _record_processes() as processes,
            startup_timeouts(START_S, processes),
        ):
            try:
                ray.init(
                    address="local",  # not a Ray that `ray start` runs on this machine
                    num_cpus=cpus,
                    num_gpus=0,
                    include_dashboard=False,
                    object_store_memory=object_store_bytes,
                    _node_ip_address="127.0.0.1",
                    **_OPTIONS,
                )
                return
            except Exception as error:
                ray.shutdown()
                # ray.shutdown ends no node that failed to start; Ray ends it only at process exit.
                for process in processes:
                    process.kill()
                died = isinstance(error, ClusterError)
                if last or not (died or "timed out" in str(error).lower()):
                    raise


@contextmanager
def on_loopback() -> Iterator[None]:
    """Make a Ray that is started inside bind its ports on 127.0.0.1 alone.

    By default Ray replaces 127.0.0.1 by the machine's outward address and listens to other
    machines.
    """
    name = ray_constants.ENABLE_RAY_CLUSTERS_ENV_VAR
    before = ray_constants.ENABLE_RAY_CLUSTER
    # Ray reads it at import: the constant is for this process, the variable for Ray's own.
    ray_constants.ENABLE_RAY_CLUSTER = False
    try:
        with _environment(name, "0"):
            yield
    finally:
        ray_constants.ENABLE_RAY_CLUSTER = before


@dataclass(frozen=True)
class _Process:
    """One process of a Ray node, with the file of its standard error."""

    name: str
    popen: subprocess.Popen[bytes]
    errors: Path | None

    def kill(self) -> None:
        """End the process and wait for it."""
        self.popen.kill()
        self.popen.wait()

    def require_running(self) -> None:
        """Raise ClusterError with its error output if a required process has ended."""
        status = self.popen.poll() if self.name in _REQUIRED else None
        if status is not None:
            raise ClusterError(f"{self} ended as it started, status {status}{self.error()}")

    def __str__(self) -> str:
        return f"Ray's {self.name}"

    def error(self) -> str:
        """': ' and the check that failed, else the first line of error output; '' without any."""
        try:
            lines = self.errors.read_text(errors="replace").splitlines() if self.errors else []
        except OSError:
            return ""
        failed = [line.partition("Check failed: ")[2] for line in lines]
        reason = next(filter(None, [*failed, *lines]), "")[:300]
        return f": {reason}" if reason else ""


@contextmanager
def startup_timeouts(seconds: float, processes: Sequence[_Process] = ()) -> Iterator[None]:
    """Raise the time-outs within which a Ray that is started inside opens its ports and registers.

    Ray waits 30 s for the control store's port and 30 s for the node, a constant of its code. A
    node registers once its two agents have imported their modules, about 10 s of a core: 45 s were
    measured at a load of ten per core. The store opens its port within a second even then, so that
    a longer wait than STORE_S is of no use to it. Raises ClusterError as soon as one of `processes`
    has ended.
    """

    def repeat(request: Callable[..., Any], timeout_s: float) -> Callable[..., Any]:
        def request_again(*given: Any, **named: Any) -> Any:
            deadline = time.monotonic() + timeout_s
            while True:
                try:
                    return request(*given, **named)
                except RuntimeError as error:
                    for process in processes:
                        process.require_running()
                    if time.monotonic() >= deadline:
                        errors = "".join(
                            f"; {one}{words}" for one in processes if (words := one.error())
                        )
                        raise ClusterError(f"Ray does not come up: {error}{errors}") from error
                time.sleep(0.2)

        return request_again

    def port_within_200_ms(*given: Any, **named: Any) -> Any:
        return port(*given, **(named | {"timeout_ms": 200}))

    port = node.wait_for_persisted_port
    port_request = repeat(port_within_200_ms, min(seconds, STORE_S))
    with (
        _replaced(node, "wait_for_persisted_port", port_request),
        _replaced(services, "get_node", repeat(services.get_node, seconds)),
    ):
        yield


@contextmanager
def _record_processes() -> Iterator[list[_Process]]:
    """List the processes of a Ray that is started inside, without those that its node starts."""
    start = services.start_ray_process

    def start_and_record(command: list[str], name: str, *given: Any, **named: Any) -> Any:
        info = start(command, name, *given, **named)
        option = "--stderr_filepath="
        paths = [Path(c.removeprefix(option)) for c in command if c.startswith(option)]
        found.append(_Process(name, info.process, next(iter(paths), None)))
        return info

    found: list[_Process] = []
    with _replaced(services, "start_ray_process", start_and_record):
        yield found


@contextmanager
def _agents_with_ports() -> Iterator[None]:
    """Choose the ports of the agents of a Ray node that is started inside.

    If the agents choose them, the node waits 15 s for each agent's port in a file, a constant of
    its code, and ends itself where an agent is slower. Three ports are arguments of the node; the
    fourth is written to that file here.
    """
    start = services.start_raylet

    def start_with_ports(*given: Any, **named: Any) -> Any:
        call = inspect.signature(start).bind(*given, **named)
        call.arguments |= dict(zip(_AGENT_PORTS, _free_ports(len(_AGENT_PORTS)), strict=True))
        of = call.arguments
        listening = of["dashboard_agent_listen_port"]
        persist_port(of["session_dir"], of["node_id"], DASHBOARD_AGENT_LISTEN_PORT_NAME, listening)
        return start(*call.args, **call.kwargs)

    with _replaced(services, "start_raylet", start_with_ports):
        yield


@contextmanager
def _replaced(module: Any, name: str, by: Callable[..., Any]) -> Iterator[None]:
    """Replace a function of a Ray module, for behaviour that has no setting."""
    before = getattr(module, name)
    setattr(module, name, by)
    try:
        yield
    finally:
        setattr(module, name, before)


def _free_ports(count: int) -> list[int]:
    """Ports of the loopback interface that are free at this moment."""
    held = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in held]
    for one in held:
        one.close()
    return ports


@contextmanager
def _importable() -> Iterator[None]:
    """Put the packages on the path of processes that are started inside, from any directory."""
    before = os.environ.get("PYTHONPATH")
    with _environment("PYTHONPATH", os.pathsep.join(filter(None, [_ROOT, before]))):
        yield


@contextmanager
def _short_session() -> Iterator[None]:
    """Put the session of a Ray that is started inside where the paths of its sockets are short
    enough."""
    given = os.environ.get("RAY_TMPDIR") or os.environ.get("TMPDIR") or ""
    short = next((f for f in ("/tmp", "/var/tmp") if os.access(f, os.W_OK | os.X_OK)), None)
    if len(os.fsencode(given)) <= SESSION_BYTES or short is None:
        yield
        return
    with _environment("RAY_TMPDIR", short):
        yield


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    """Set an environment variable."""
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


def require_listener(address: str, inherited: bool = False) -> None:
    """Raise ClusterError where nothing listens at a Ray address; Ray itself retries for minutes.

    inherited: whether the address is that of RAY_ADDRESS, for the message.
    """
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not colon:
        return
    if not port.isdigit():
        raise ClusterError(f"'{address}' is no Ray address: write HOST:PORT, or auto")
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=5).close()
    except OSError as error:
        given = f"RAY_ADDRESS={address}" if inherited else address
        other = "unset RAY_ADDRESS" if inherited else "leave --address out"
        raise ClusterError(
            f"no Ray answers at {given} ({error.strerror or error}): start one with"
            f" 'ray start --head --port {port}', or {other} to use this machine"
        ) from error
