"""gRPC server on an event loop with the features of `rpc.server`, for services of coroutines."""

import asyncio
import os
import signal
from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar
from wsgiref.simple_server import WSGIServer

import grpc
from grpc_health.v1 import health, health_pb2_grpc
from grpc_reflection.v1alpha import reflection, reflection_pb2_grpc
from prometheus_client import CollectorRegistry

from rpc.aio_interceptors import CallWatch, require_token, rewrap
from rpc.credentials import read_token
from rpc.interceptors import Errors
from rpc.malformed import defer_parse_errors
from rpc.server import (
    INTERRUPTED,
    SERVING,
    ServerConfig,
    bind,
    bind_probe,
    check,
    close_metrics,
    options,
    serve_metrics,
)

Handlers = Mapping[str, grpc.RpcMethodHandler]
T = TypeVar("T")


def run(main: Coroutine[Any, Any, T]) -> T:
    """Return what a coroutine returns, run on uvloop where it is installed (a quarter faster), else
    on asyncio."""
    try:
        import uvloop
    except ImportError:
        return asyncio.run(main)
    return uvloop.run(main)


class AioServer:
    """A gRPC server: add services, start it, drain it.

    To be made, used and drained within one running event loop.
    """

    def __init__(self, config: ServerConfig, errors: Errors | None = None) -> None:
        """Bind the address; `errors` as in CallWatch.

        Raises RpcError if the address is in use, or open to other machines without protection.
        """
        self.config = config
        check(config)
        self.registry = CollectorRegistry()
        self._token = config.token or (read_token(config.token_file) if config.token_file else "")
        self._watch = CallWatch(self.registry, errors or {})
        self.grpc = grpc.aio.server(options=options(config))
        self.address = bind(self.grpc, config)
        self.health = health.aio.HealthServicer()
        self.stopping = asyncio.Event()
        self._caught: list[signal.Signals] | None = None
        self._metrics: WSGIServer | None = None
        self.probe: grpc.aio.Server | None = None
        self.health_address = ""
        if config.health:
            self.probe = grpc.aio.server()
            self.health_address = bind_probe(self.probe, config.health)

    def add(self, add_to_server: Callable[[Any, Any], None], servicer: object) -> None:
        """Add a service by its generated function `add_...Servicer_to_server`."""
        add_to_server(servicer, _Registrar(self._register_watched))

    def _register_watched(self, service: str, handlers: Handlers) -> None:
        watch = self._watch
        self._register(
            service,
            {
                name: defer_parse_errors(rewrap(handler, partial(watch.wrap, f"/{service}/{name}")))
                for name, handler in handlers.items()
            },
        )

    def _register(self, service: str, handlers: Handlers) -> None:
        if self._token:
            ask = partial(require_token, self._token)
            handlers = {name: rewrap(handler, ask) for name, handler in handlers.items()}
        handler = grpc.method_handlers_generic_handler(service, dict(handlers))
        self.grpc.add_generic_rpc_handlers((handler,))

    async def start(self, services: Sequence[str]) -> None:
        """Serve the added services, by full name (`rpc.v1.Policy`)."""
        # without a token, which health probes do not send
        health_pb2_grpc.add_HealthServicer_to_server(self.health, self.grpc)
        names = [*services, health.SERVICE_NAME, reflection.SERVICE_NAME]
        reflection_pb2_grpc.add_ServerReflectionServicer_to_server(
            reflection.aio.ReflectionServicer(names), _Registrar(self._register)
        )
        if self.config.metrics:
            self._metrics = serve_metrics(self.config.metrics, self.registry)
        await self.grpc.start()
        if self.probe is not None:
            health_pb2_grpc.add_HealthServicer_to_server(self.health, self.probe)
            await self.probe.start()
        for name in ["", *services]:
            await self.health.set(name, SERVING)

    def catch_signals(self) -> None:
        """From now on SIGTERM and SIGINT end `wait`, and a SIGINT after either ends the process at
        once. To be called before anyone is told that the server runs: a signal that comes before is
        the end of the process. Main thread only."""
        if self._caught is not None:
            return
        loop, caught = asyncio.get_running_loop(), list[signal.Signals]()

        def stop(number: signal.Signals) -> None:
            if caught and number == signal.SIGINT:
                os._exit(INTERRUPTED)  # calls in progress would keep anything milder waiting
            caught.append(number)
            self.stopping.set()

        for number in (signal.SIGTERM, signal.SIGINT):
            loop.add_signal_handler(number, stop, number)
        self._caught = caught

    async def wait(self) -> bool:
        """Wait for SIGTERM, for SIGINT, or until `stopping` is set; return whether SIGINT came
        first. Main thread only."""
        self.catch_signals()
        await self.stopping.wait()
        return (self._caught or [])[:1] == [signal.SIGINT]

    async def drain(self, before_the_end: Callable[[], Awaitable[None]] | None = None) -> None:
        """Report NOT_SERVING, refuse new calls, wait for those in progress, stop.

        before_the_end: called when `drain_s` is nearly over, to end calls that still run.
        """
        self.stopping.set()
        await self.health.enter_graceful_shutdown()
        stopped = asyncio.ensure_future(self.grpc.stop(self.config.drain_s))
        if before_the_end is not None:
            await asyncio.wait([stopped], timeout=0.9 * self.config.drain_s)
            if not stopped.done():
                await before_the_end()
        await stopped
        if self.probe is not None:
            await self.probe.stop(0)
        if self._metrics is not None:
            close_metrics(self._metrics)
            self._metrics = None


class _Registrar:
    """Stand-in for a server in generated code, which passes the handlers on."""

    def __init__(self, register: Callable[[str, Handlers], None]) -> None:
        self.add_registered_method_handlers = register

    def add_generic_rpc_handlers(self, handlers: object) -> None:
        """Ignored: the same handlers in an opaque form."""
