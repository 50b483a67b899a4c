"""The server's shell: health, reflection, metrics, TLS, token, and a drain before the end."""

import os
import signal
import socket
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import grpc
from grpc_health.v1 import health, health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection
from prometheus_client import CollectorRegistry, start_http_server

from rpc.address import is_local, split_address
from rpc.credentials import read_token, server_credentials
from rpc.errors import RpcError
from rpc.interceptors import CallInterceptor, TokenInterceptor

SERVING = health_pb2.HealthCheckResponse.SERVING
NOT_SERVING = health_pb2.HealthCheckResponse.NOT_SERVING


@dataclass(frozen=True)
class ServerConfig:
    """Where a service listens, and to whom."""

    listen: str = "127.0.0.1:0"
    """HOST:PORT (port 0: any free one) or unix:PATH."""
    tls_cert: str = ""
    """File with the service's certificate."""
    tls_key: str = ""
    """File with its key."""
    tls_client_ca: str = ""
    """File with the certificates that must have signed the clients' (mutual TLS)."""
    token_file: str = ""
    """File with the bearer token that every call must show."""
    allow_insecure_remote: bool = False
    """Listen to other machines without TLS and a token."""
    metrics: str = ""
    """HOST:PORT for Prometheus; empty: none."""
    workers: int = 4
    """Calls in progress at a time; more wait."""
    max_message_bytes: int = 4 << 20
    """Largest single message."""
    drain_s: float = 10.0
    """Time for calls in progress to end when told to stop."""


class Server:
    """A gRPC server to which services are added, then started, then drained."""

    def __init__(
        self,
        config: ServerConfig,
        errors: Mapping[type[Exception], grpc.StatusCode] | None = None,
    ) -> None:
        """Bind the address, `errors` as in CallInterceptor.

        Raises RpcError if the address is taken, or open to other machines without protection.
        """
        self.config = config
        _check(config)
        self.registry = CollectorRegistry()
        interceptors: list[grpc.ServerInterceptor] = [CallInterceptor(self.registry, errors or {})]
        if config.token_file:
            interceptors.insert(0, TokenInterceptor(read_token(config.token_file)))
        self.grpc = grpc.server(
            ThreadPoolExecutor(config.workers, thread_name_prefix="rpc"),
            interceptors=interceptors,
            options=[
                ("grpc.so_reuseport", 0),  # a second server on the port is a mistake
                ("grpc.max_receive_message_length", config.max_message_bytes),
            ],
        )
        self.address = self._bind()
        self.health = health.HealthServicer()
        self.stopping = threading.Event()
        self._metrics_server = None

    def start(self, services: Sequence[str]) -> None:
        """Serve the added services, by full name (`rpc.v1.Style`)."""
        health_pb2_grpc.add_HealthServicer_to_server(self.health, self.grpc)
        names = [*services, health.SERVICE_NAME, reflection.SERVICE_NAME]
        reflection.enable_server_reflection(names, self.grpc)
        if self.config.metrics:
            host, port = split_address(self.config.metrics)
            try:
                self._metrics_server, _ = start_http_server(port, host, self.registry)
            except OSError as error:
                raise RpcError(
                    f"metrics: cannot listen on {self.config.metrics}: {error.strerror}"
                ) from error
        self.grpc.start()
        for name in ["", *services]:
            self.health.set(name, SERVING)

    def run(self) -> None:
        """Block until SIGTERM, SIGINT or `stopping` is set, then drain. Main thread only."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: self.stopping.set())
        while not self.stopping.wait(1.0):  # a bounded wait, so that signals are seen
            pass
        self.drain()

    def drain(self) -> None:
        """Say NOT_SERVING, take no more calls, let those in progress end, stop."""
        self.stopping.set()
        self.health.enter_graceful_shutdown()
        self.grpc.stop(self.config.drain_s).wait()
        if self._metrics_server is not None:
            self._metrics_server.shutdown()
            self._metrics_server.server_close()
            self._metrics_server = None

    def _bind(self) -> str:
        listen = self.config.listen
        try:
            if self.config.tls_cert:
                credentials = server_credentials(
                    self.config.tls_cert, self.config.tls_key, self.config.tls_client_ca
                )
                port = self.grpc.add_secure_port(listen, credentials)
            else:
                port = self.grpc.add_insecure_port(listen)
        except RuntimeError as error:
            raise RpcError(f"cannot listen on {listen}: {_why_not(listen)}") from error
        if listen.startswith("unix:"):
            return listen
        return f"{listen.rpartition(':')[0]}:{port}"


def _check(config: ServerConfig) -> None:
    if bool(config.tls_cert) != bool(config.tls_key):
        raise RpcError("tls_cert and tls_key: give both or neither")
    if config.tls_client_ca and not config.tls_cert:
        raise RpcError("tls_client_ca: needs tls_cert and tls_key")
    protected = config.tls_cert and (config.token_file or config.tls_client_ca)
    if not is_local(config.listen) and not protected and not config.allow_insecure_remote:
        raise RpcError(
            f"{config.listen} is open to other machines: give tls_cert, tls_key and token_file, "
            "listen on 127.0.0.1, or allow_insecure_remote"
        )


def _why_not(listen: str) -> str:
    """The operating system's reason why an address cannot be bound."""
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
