"""gRPC server with health checks, reflection, metrics, TLS, token and draining."""

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from types import FrameType
from typing import Any
from wsgiref.simple_server import WSGIServer

import grpc
from grpc_health.v1 import health, health_pb2_grpc
from grpc_reflection.v1alpha import reflection
from prometheus_client import CollectorRegistry, start_http_server

from rpc.address import is_local, split_address
from rpc.credentials import read_token, server_credentials
from rpc.errors import RpcError, SettingsError
from rpc.first_message import FirstMessageInterceptor
from rpc.health import NOT_SERVING, SERVING, HealthServicer
from rpc.health import WORKERS as HEALTH_WORKERS
from rpc.interceptors import CallInterceptor, TokenInterceptor
from rpc.stream_guard import StreamGuard

INTERRUPTED = 130
"""Exit code of a process that Ctrl-C ends at once."""
METRICS_S = 5.0
"""Time after which a silent connection to the metrics is closed, s."""
SIGNALS_S = 0.5
"""Longest wait of the main thread, between whose waits signals are handled, s."""


@dataclass(frozen=True)
class ServerConfig:
    """Address, protection and limits of a server."""

    listen: str = "127.0.0.1:0"
    """HOST:PORT (port 0: any free one) or unix:PATH."""
    tls_cert: str = ""
    """File with the service's certificate."""
    tls_key: str = ""
    """File with its key."""
    tls_client_ca: str = ""
    """File with the authorities that must have signed the clients' certificates (mutual TLS)."""
    token_file: str = ""
    """File with the bearer token that every call must have."""
    token: str = field(default="", repr=False)
    """The bearer token itself, instead of a file, for a service that a process starts for its own
    use."""
    allow_insecure_remote: bool = False
    """Listen to other machines without TLS and a token."""
    metrics: str = ""
    """HOST:PORT for Prometheus; empty: none."""
    health: str = ""
    """HOST:PORT that answers health checks alone, without TLS or token, for probes that have
    neither, such as those of Kubernetes; empty: none."""
    workers: int = 12
    """Most calls in progress at a time; more wait."""
    streams: int = 4
    """Most streaming calls in progress; more are refused, so that health checks and short calls
    always find a worker."""
    idle_s: float = 20.0
    """Longest time that a streaming call waits for its client to send or read one message."""
    message_s: float = 5.0
    """Longest time that any other call waits for its single message."""
    stream_s: float = 300.0
    """Longest time that a streaming call waits for its client in total."""
    max_message_bytes: int = 4 << 20
    """Largest single message."""
    drain_s: float = 10.0
    """Time for calls in progress to end before the server stops."""


class Server:
    """A gRPC server: add services, start it, drain it."""

    def __init__(
        self,
        config: ServerConfig,
        errors: Mapping[type[Exception], grpc.StatusCode] | None = None,
    ) -> None:
        """Bind the address; `errors` as in CallInterceptor.

        Raises RpcError if the address is in use, or open to other machines without protection.
        """
        self.config = config
        check(config)
        self.registry = CollectorRegistry()
        self.guard = StreamGuard(config.streams, config.idle_s, config.stream_s, self._set_full)
        # never refuses: there are no more calls than workers
        self.first = StreamGuard(
            config.workers + 2 * HEALTH_WORKERS,
            config.message_s,
            config.message_s,
        )
        interceptors: list[grpc.ServerInterceptor] = [
            CallInterceptor(self.registry, errors or {}, self.guard, self.first)
        ]
        if config.token_file or config.token:
            token = config.token or read_token(config.token_file)
            interceptors.insert(0, TokenInterceptor(token))
        self.grpc = grpc.server(
            ThreadPoolExecutor(config.workers, thread_name_prefix="rpc"),
            interceptors=interceptors,
            options=options(config),
        )
        self.address = bind(self.grpc, config)
        self.health = HealthServicer()
        self._services: tuple[str, ...] = ()
        self.stopping = threading.Event()
        self._metrics: WSGIServer | None = None
        self.probe: grpc.Server | None = None
        self.health_address = ""
        if config.health:
            self.probe = grpc.server(
                ThreadPoolExecutor(HEALTH_WORKERS, "probe"),
                interceptors=[FirstMessageInterceptor(self.first)],
            )
            self.health_address = bind_probe(self.probe, config.health)

    def start(self, services: Sequence[str]) -> None:
        """Serve the added services, by full name (`rpc.v1.Style`)."""
        health_pb2_grpc.add_HealthServicer_to_server(self.health, self.grpc)
        names = [*services, health.SERVICE_NAME, reflection.SERVICE_NAME]
        reflection.enable_server_reflection(names, self.grpc)
        if self.config.metrics:
            self._metrics = serve_metrics(self.config.metrics, self.registry)
        self.grpc.start()
        if self.probe is not None:
            health_pb2_grpc.add_HealthServicer_to_server(self.health, self.probe)
            self.probe.start()
        self._services = tuple(services)
        for name in ["", *services]:
            self.health.set(name, SERVING)

    def _set_full(self, full: bool) -> None:
        """Set the health of the services, not of the process, to NOT_SERVING while full."""
        for name in self._services:
            self.health.set(name, NOT_SERVING if full else SERVING)

    def run(
        self,
        report: Callable[[str], None] = lambda line: None,
        started: Callable[[], None] = lambda: None,
    ) -> bool:
        """Block until SIGTERM, SIGINT or `stopping` is set, then drain; return whether SIGINT came
        first. A SIGINT during the drain ends the process at once. Main thread only.

        report: takes a line when it stops. started: is called once signals are handled; who is told
        before that the server runs, may end it without a drain.
        """
        first: list[int] = []

        def stop(number: int, _frame: FrameType | None) -> None:
            if first and number == signal.SIGINT:
                os._exit(INTERRUPTED)
            first.append(number)
            self.stopping.set()

        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, stop)
        started()
        while not self.stopping.wait(SIGNALS_S):
            pass
        with contextlib.suppress(OSError):  # nobody may read it any more
            report(stopping(self.config.drain_s))
        self.drain()
        return first[:1] == [signal.SIGINT]

    def drain(self) -> None:
        """Report NOT_SERVING, refuse new calls, wait for those in progress, stop."""
        self.stopping.set()
        self.guard.close()
        self.first.close()
        self.health.enter_graceful_shutdown()
        stopped = self.grpc.stop(self.config.drain_s)
        while not stopped.wait(SIGNALS_S):  # a bounded wait, so that signals are handled
            pass
        if self.probe is not None:
            self.probe.stop(0).wait()
        if self._metrics is not None:
            close_metrics(self._metrics)
            self._metrics = None


def stopping(drain_s: float) -> str:
    """Return the line that a server says when it begins to drain."""
    return f"stopping: calls in progress have {drain_s:g} s to end; Ctrl-C stops at once"


def bind(server: grpc.Server | grpc.aio.Server, config: ServerConfig) -> str:
    """Bind a server to the configured address, with TLS if configured; returns the address."""
    listen = config.listen
    try:
        if config.tls_cert:
            credentials = server_credentials(config.tls_cert, config.tls_key, config.tls_client_ca)
            port = server.add_secure_port(listen, credentials)
        else:
            port = server.add_insecure_port(listen)
    except RuntimeError as error:
        raise RpcError(f"cannot listen on {listen}: {_bind_error(listen)}") from error
    if listen.startswith("unix:"):
        return listen
    return f"{listen.rpartition(':')[0]}:{port}"


def bind_probe(server: grpc.Server | grpc.aio.Server, address: str) -> str:
    """Bind a server for health checks to an address without TLS; returns the address."""
    return bind(server, ServerConfig(listen=address))


def options(config: ServerConfig) -> list[tuple[str, int]]:
    """Channel arguments of every server."""
    return [
        ("grpc.so_reuseport", 0),  # refuse a second server on the port
        ("grpc.max_receive_message_length", config.max_message_bytes),
        # Clients ping during a long call; by default the server closes the connection after three
        # pings.
        ("grpc.http2.min_ping_interval_without_data_ms", 1_000),
    ]


def serve_metrics(address: str, registry: CollectorRegistry) -> WSGIServer:
    """Prometheus endpoint at HOST:PORT on a thread of its own; `close_metrics` ends it."""
    host, port = split_address(address)
    try:
        server = start_http_server(port, host, registry)[0]
    except OSError as error:
        raise RpcError(f"metrics: cannot listen on {address}: {error.strerror}") from error
    # each connection has a thread, so a silent one must be closed
    handler: Any = server.RequestHandlerClass
    bounded = type("BoundedHandler", (handler,), {"timeout": METRICS_S})
    server.RequestHandlerClass = bounded  # pyright: ignore[reportAttributeAccessIssue]
    return server


def close_metrics(server: WSGIServer) -> None:
    """Stop a metrics endpoint."""
    server.shutdown()
    server.server_close()


def check(config: ServerConfig) -> None:
    """Raise SettingsError where settings contradict one another, or leave a remote address
    unprotected."""
    if bool(config.tls_cert) != bool(config.tls_key):
        raise SettingsError("tls_cert and tls_key: give both or neither")
    if config.tls_client_ca and not config.tls_cert:
        raise SettingsError("tls_client_ca: needs tls_cert and tls_key")
    protected = config.tls_cert and (config.token_file or config.token or config.tls_client_ca)
    if not is_local(config.listen) and not protected and not config.allow_insecure_remote:
        raise SettingsError(
            f"{config.listen} is open to other machines: give tls_cert, tls_key and token_file, "
            "listen on 127.0.0.1, or allow_insecure_remote"
        )


def _bind_error(listen: str) -> str:
    """Reason of the operating system why an address cannot be bound."""
    advice = "choose another port (0: any free one)"
    if listen.startswith("unix:"):
        return "the path must be writable and at most 107 bytes long"
    host, port = split_address(listen)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.bind((host, port))
            probe.listen()
    except OSError as error:
        return f"{os.strerror(error.errno) if error.errno else error}; {advice}"
    return f"the port was taken a moment ago; {advice}"
