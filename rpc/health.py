"""Health service of a synchronous server, which no watching client can stop.

grpcio-health-checking's servicer sends to its watchers while it holds its lock. A watcher that
leaves at that moment makes gRPC's own thread wait for the lock, and the sending wait for that
thread: the whole server stands still. A watcher that reads nothing holds the lock as well.
"""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import grpc
from grpc_health.v1 import health, health_pb2

WORKERS = 4
"""Most Watch calls that are begun at a time."""
SERVING = health_pb2.HealthCheckResponse.SERVING
NOT_SERVING = health_pb2.HealthCheckResponse.NOT_SERVING


class _Context:
    """Context of a Watch call whose end is told by another thread than gRPC's own."""

    def __init__(self, context: grpc.ServicerContext, told: ThreadPoolExecutor) -> None:
        self._context, self._told = context, told

    def add_callback(self, callback: Callable[[], None]) -> bool:
        """Call `callback` after the call has ended, at once if it already has."""

        def tell() -> None:
            self._told.submit(callback)

        later = self._context.add_callback(tell)
        if not later:
            tell()
        return later


class HealthServicer(health.HealthServicer):
    """Statuses are read and set without waiting for watchers; a Watch call holds no worker."""

    def __init__(self) -> None:
        self._statuses = {"": SERVING}
        self._shut = False
        self._guard = threading.Lock()
        self._sent = ThreadPoolExecutor(1, "health-set")
        self._ended = ThreadPoolExecutor(1, "health-end")
        super().__init__(
            experimental_non_blocking=True,
            experimental_thread_pool=ThreadPoolExecutor(WORKERS, "health"),
        )

    def Check(
        self, request: health_pb2.HealthCheckRequest, context: grpc.ServicerContext
    ) -> health_pb2.HealthCheckResponse:
        """The status of a service; NOT_FOUND for one that is not known."""
        status = self._statuses.get(request.service)
        if status is None:
            context.set_code(grpc.StatusCode.NOT_FOUND)
            return health_pb2.HealthCheckResponse()
        return health_pb2.HealthCheckResponse(status=status)

    def Watch(
        self,
        request: health_pb2.HealthCheckRequest,
        context: grpc.ServicerContext,
        send_response_callback: Any = None,
    ) -> Any:
        """The status of a service, and each change of it."""
        told: Any = _Context(context, self._ended)
        return super().Watch(request, told, send_response_callback)

    def set(self, service: str, status: health_pb2.HealthCheckResponse.ServingStatus) -> None:
        """Set the status of a service; ignored once the server shuts down."""
        with self._guard:
            if not self._shut:
                self._statuses[service] = status
                # one thread: watchers hear of changes in their order
                self._sent.submit(super().set, service, status)

    def enter_graceful_shutdown(self) -> None:
        """Set all services to NOT_SERVING for good."""
        with self._guard:
            self._shut = True
            self._statuses = dict.fromkeys(self._statuses, NOT_SERVING)
            self._sent.submit(super().enter_graceful_shutdown)
