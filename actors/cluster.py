"""Ray itself: started on this machine and quiet, or joined where it already runs."""

import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ray

from world.errors import InhabitError

NAMESPACE = "inhabit"
_QUIET: dict[str, Any] = {
    "namespace": NAMESPACE,
    "log_to_driver": False,
    "logging_level": "ERROR",
}
_ROOT = str(Path(__file__).resolve().parent.parent)
# Ray turns 127.0.0.1 into the machine's outward address; another address of the loopback stays.
_LOOPBACK = "127.0.0.2" if sys.platform == "linux" else "127.0.0.1"


class ClusterError(InhabitError):
    """Ray cannot be started or joined."""


@contextmanager
def ray_session(
    cpus: int, address: str | None = None, object_store_bytes: int = 256 * 2**20
) -> Iterator[None]:
    """Ray for the length of a `with`; one that already runs in this process is used and left.

    Without `address`, a private one on this machine with `cpus` slots (bookkeeping: Ray does not
    pin cores), no dashboard, known to no other machine. With HOST:PORT or 'auto', a cluster.
    """
    if ray.is_initialized():
        yield
        return
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    try:
        if address is None:
            _start(cpus, object_store_bytes)
        else:
            _require_listener(address)
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
    """A private Ray. It gives itself 30 s to start; a busy machine gets a second try."""
    with _importable():
        for last in (False, True):
            try:
                ray.init(
                    num_cpus=cpus,
                    num_gpus=0,
                    include_dashboard=False,
                    object_store_memory=object_store_bytes,
                    _node_ip_address=_LOOPBACK,
                    **_QUIET,
                )
                return
            except Exception as error:
                ray.shutdown()
                if last or "timed out" not in str(error).lower():
                    raise


@contextmanager
def _importable() -> Iterator[None]:
    """The rooms on the path of the processes started inside, wherever this one was started."""
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [_ROOT, before]))
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONPATH"]
        else:
            os.environ["PYTHONPATH"] = before


def _require_listener(address: str) -> None:
    """Ray itself would try for minutes where nobody listens."""
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
