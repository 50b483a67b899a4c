"""Ray itself: started on this machine and quiet, or joined where it already runs."""

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

# Read at Ray's first call: rpc/__init__.py says what it is for.
os.environ.setdefault("GRPC_ENABLE_FORK_SUPPORT", "0")

NAMESPACE = "inhabit"
_QUIET: dict[str, Any] = {
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
#: Without these there is no Ray; its monitors may end.
_VITAL = (ray_constants.PROCESS_TYPE_GCS_SERVER, ray_constants.PROCESS_TYPE_RAYLET)
START_S = 180.0
STORE_S = 60.0


class ClusterError(InhabitError):
    """Ray cannot be started or joined."""


@contextmanager
def ray_session(
    cpus: int, address: str | None = None, object_store_bytes: int = 256 * 2**20
) -> Iterator[None]:
    """Ray for the length of a `with`; one that already runs in this process is used and left.

    Without `address`, the cluster that a submitted job runs in, else a private Ray on this machine
    with `cpus` slots (bookkeeping: Ray does not pin cores), no dashboard, on the loopback alone.
    With HOST:PORT or 'auto', a cluster. Raises ClusterError where it cannot be had.
    """
    if ray.is_initialized():
        yield
        return
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    address = address or os.environ.get("RAY_ADDRESS")
    try:
        if address is None:
            _start(cpus, object_store_bytes)
        else:
            require_listener(address)
            ray.init(address=address, **_QUIET)
    except ClusterError:
        raise
    # Ray's own errors of starting and joining have no common base below Exception.
    except Exception as error:
        ray.shutdown()
        where = f"join Ray at {address}" if address else "start Ray on this machine"
        reason = next(iter(str(error).strip().splitlines()), type(error).__name__)
        raise ClusterError(f"could not {where}: {reason}") from error
    try:
        yield
    finally:
        ray.shutdown()


def _start(cpus: int, object_store_bytes: int) -> None:
    """A private Ray; one that does not come up is ended, and tried again."""
    for last in (False, False, True):
        with (
            _importable(),
            on_loopback(),
            _agents_with_ports(),
            _started() as processes,
            patience(START_S, processes),
        ):
            try:
                ray.init(
                    address="local",  # not one that `ray start` began on this machine
                    num_cpus=cpus,
                    num_gpus=0,
                    include_dashboard=False,
                    object_store_memory=object_store_bytes,
                    _node_ip_address="127.0.0.1",
                    **_QUIET,
                )
                return
            except Exception as error:
                ray.shutdown()
                # Which knows nothing of a node that never came to be: Ray ends that at its exit.
                for process in processes:
                    process.kill()
                died = isinstance(error, ClusterError)
                if last or not (died or "timed out" in str(error).lower()):
                    raise


@contextmanager
def on_loopback() -> Iterator[None]:
    """The Ray started inside takes 127.0.0.1 for its address, and so binds every port there alone.

    Otherwise it would turn 127.0.0.1 into the machine's outward address, and listen to everyone.
    """
    name = ray_constants.ENABLE_RAY_CLUSTERS_ENV_VAR
    before = ray_constants.ENABLE_RAY_CLUSTER
    # Read once, at the import of ray: by now both are needed, one for Ray's own processes.
    ray_constants.ENABLE_RAY_CLUSTER = False
    try:
        with _environment(name, "0"):
            yield
    finally:
        ray_constants.ENABLE_RAY_CLUSTER = before


@dataclass(frozen=True)
class _Process:
    """One of the processes that make a Ray node, and where it writes what it dies of."""

    name: str
    popen: subprocess.Popen[bytes]
    errors: Path | None

    def kill(self) -> None:
        self.popen.kill()
        self.popen.wait()

    def require_running(self) -> None:
        """ClusterError with its reason where it has ended, and Ray cannot be without it."""
        status = self.popen.poll() if self.name in _VITAL else None
        if status is not None:
            raise ClusterError(f"{self} ended as it started, status {status}{self.said()}")

    def __str__(self) -> str:
        return f"Ray's {self.name}"

    def said(self) -> str:
        """': ' and the check that failed, else the first of its errors; '' where there is none."""
        try:
            lines = self.errors.read_text(errors="replace").splitlines() if self.errors else []
        except OSError:
            return ""
        failed = [line.partition("Check failed: ")[2] for line in lines]
        reason = next(filter(None, [*failed, *lines]), "")[:300]
        return f": {reason}" if reason else ""


@contextmanager
def patience(seconds: float, processes: Sequence[_Process] = ()) -> Iterator[None]:
    """The Ray started inside may take so long to open its store's port and to register its node.

    Ray waits 30 s for each, for the node by a constant of its code. A node registers when its two
    agents have imported what they need, about 10 s of a core: 45 s were measured on a machine with
    ten times as much to do as it has cores. Ray asks in a loop, and gives up when a failed answer
    comes after its 30 s. The store is there within a second even then: what keeps it for a minute
    is not cured by waiting. ClusterError as soon as one of `processes` has ended.
    """

    def patient(ask: Callable[..., Any], at_most_s: float) -> Callable[..., Any]:
        def ask_again(*given: Any, **named: Any) -> Any:
            deadline = time.monotonic() + at_most_s
            while True:
                try:
                    return ask(*given, **named)
                except RuntimeError as error:
                    for process in processes:
                        process.require_running()
                    if time.monotonic() >= deadline:
                        said = "".join(
                            f"; {one}{words}" for one in processes if (words := one.said())
                        )
                        raise ClusterError(f"Ray does not come up: {error}{said}") from error
                time.sleep(0.2)

        return ask_again

    def ask_shortly(*given: Any, **named: Any) -> Any:
        return port(*given, **(named | {"timeout_ms": 200}))

    port = node.wait_for_persisted_port
    with (
        _replaced(node, "wait_for_persisted_port", patient(ask_shortly, min(seconds, STORE_S))),
        _replaced(services, "get_node", patient(services.get_node, seconds)),
    ):
        yield


@contextmanager
def _started() -> Iterator[list[_Process]]:
    """The processes that a Ray started inside is made of, but for what its node starts."""
    start = services.start_ray_process

    def start_and_tell(command: list[str], name: str, *given: Any, **named: Any) -> Any:
        info = start(command, name, *given, **named)
        option = "--stderr_filepath="
        paths = [Path(c.removeprefix(option)) for c in command if c.startswith(option)]
        found.append(_Process(name, info.process, next(iter(paths), None)))
        return info

    found: list[_Process] = []
    with _replaced(services, "start_ray_process", start_and_tell):
        yield found


@contextmanager
def _agents_with_ports() -> Iterator[None]:
    """The node of a Ray started inside has its agents' ports from us.

    Where they choose their own, it waits 15 s for each to say which in a file, a constant of its
    code, and ends itself if they are slower. Three it then knows; the fourth is in that file.
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
    """Another function in a module of Ray's, where it has no setting."""
    before = getattr(module, name)
    setattr(module, name, by)
    try:
        yield
    finally:
        setattr(module, name, before)


def _free_ports(count: int) -> list[int]:
    """Of the loopback, at this moment."""
    held = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in held]
    for one in held:
        one.close()
    return ports


@contextmanager
def _importable() -> Iterator[None]:
    """The rooms on the path of the processes started inside, wherever this one was started."""
    before = os.environ.get("PYTHONPATH")
    with _environment("PYTHONPATH", os.pathsep.join(filter(None, [_ROOT, before]))):
        yield


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


def require_listener(address: str) -> None:
    """ClusterError where nobody listens: Ray itself would try for minutes."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not colon:
        return
    if not port.isdigit():
        raise ClusterError(f"'{address}' is no Ray address: write HOST:PORT, or auto")
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=5).close()
    except OSError as error:
        raise ClusterError(
            f"no Ray answers at {address} ({error.strerror or error}): start one with"
            f" 'ray start --head --port {port}', or leave --address out to use this machine"
        ) from error
