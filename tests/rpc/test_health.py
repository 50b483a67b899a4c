"""The health service stands still for no watcher, whether it leaves or does not read."""

import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc

from rpc.health import HealthServicer
from rpc.server import ServerConfig
from tests.support.rpc.services import serving

Status = health_pb2.HealthCheckResponse
REQUEST = health_pb2.HealthCheckRequest(service="x")


class Watcher:
    """A Watch call without a network: what is sent to it, and how it ends."""

    def __init__(self, active: bool = True) -> None:
        self.heard: list[int] = []
        self.sent = threading.Event()
        self.free = threading.Event()
        self.free.set()
        self.ended: list[Callable[[], None]] = []
        self._active = active

    def add_callback(self, callback: Callable[[], None]) -> bool:
        self.ended.append(callback)
        return self._active

    def send(self, response: Any) -> None:
        self.sent.set()
        self.free.wait(30)
        if response is not None:
            self.heard.append(response.status)


@pytest.fixture
def servicer() -> HealthServicer:
    found = HealthServicer()
    found.set("x", Status.SERVING)
    return found


def check(servicer: HealthServicer) -> int:
    return servicer.Check(REQUEST, cast(grpc.ServicerContext, SimpleNamespace())).status


def watch(servicer: HealthServicer, watcher: Watcher) -> None:
    servicer.Watch(REQUEST, cast(grpc.ServicerContext, watcher), watcher.send)


def done(servicer: HealthServicer) -> None:
    """Wait until all that was set has been sent, and all that ended is told."""
    for pool in (servicer._sent, servicer._ended):
        pool.submit(lambda: None).result(30)


def test_a_watcher_that_leaves_while_it_is_sent_to_holds_up_nobody(
    servicer: HealthServicer,
) -> None:
    """Sending ends only after gRPC's thread has told the end of the call, as it is in gRPC."""
    watcher = Watcher()
    done(servicer)
    watch(servicer, watcher)
    watcher.sent.clear()
    watcher.free.clear()
    servicer.set("x", Status.NOT_SERVING)
    assert watcher.sent.wait(30)
    told = threading.Event()

    def grpc_thread() -> None:
        for callback in watcher.ended:
            callback()
        told.set()

    threading.Thread(target=grpc_thread, daemon=True).start()
    assert told.wait(10), "gRPC's own thread waits for no lock"
    watcher.free.set()
    done(servicer)
    assert watcher.heard == [Status.SERVING, Status.NOT_SERVING]
    servicer.set("x", Status.SERVING)
    done(servicer)
    assert watcher.heard == [Status.SERVING, Status.NOT_SERVING], "it has left"


def test_a_watcher_that_reads_nothing_holds_up_no_check(servicer: HealthServicer) -> None:
    watcher = Watcher()
    watch(servicer, watcher)
    watcher.free.clear()
    servicer.set("x", Status.NOT_SERVING)
    assert check(servicer) == Status.NOT_SERVING
    servicer.enter_graceful_shutdown()
    servicer.set("x", Status.SERVING)
    assert check(servicer) == Status.NOT_SERVING, "a server that shuts down stays so"
    watcher.free.set()
    done(servicer)
    assert watcher.heard[-1] == Status.NOT_SERVING


def test_a_watcher_that_had_left_already_is_forgotten(servicer: HealthServicer) -> None:
    watcher = Watcher(active=False)
    done(servicer)
    watch(servicer, watcher)
    done(servicer)
    servicer.set("x", Status.NOT_SERVING)
    done(servicer)
    assert watcher.heard == [Status.SERVING]


def test_an_unknown_service_is_not_found() -> None:
    with serving(ServerConfig()) as (server, _), grpc.insecure_channel(server.address) as channel:
        stub = health_pb2_grpc.HealthStub(channel)
        with pytest.raises(grpc.RpcError) as caught:
            stub.Check(health_pb2.HealthCheckRequest(service="none"), timeout=30)
        assert cast(grpc.Call, caught.value).code() is grpc.StatusCode.NOT_FOUND


def test_a_server_drains_while_its_watchers_leave() -> None:
    for _ in range(5):
        with (
            serving(ServerConfig()) as (server, _),
            grpc.insecure_channel(server.address) as channel,
        ):
            stub = health_pb2_grpc.HealthStub(channel)
            watchers = [stub.Watch(health_pb2.HealthCheckRequest()) for _ in range(40)]
            for watcher in watchers:
                assert next(watcher).status == Status.SERVING
            for watcher in watchers:
                watcher.cancel()
