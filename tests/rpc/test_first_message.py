"""A call that sends no message gives its worker back, also at the port of the probes."""

import threading
from collections.abc import Iterator

import grpc
from grpc_health.v1 import health_pb2, health_pb2_grpc

from rpc.first_message import bounded
from rpc.server import ServerConfig
from rpc.stream_guard import StreamGuard
from tests.support.rpc.services import serving


def test_a_handler_of_streams_is_unchanged() -> None:
    guard = StreamGuard(1, 1.0, 1.0)
    handler = grpc.stream_unary_rpc_method_handler(lambda messages, context: b"")
    assert bounded(handler, guard) is handler
    single = bounded(grpc.unary_stream_rpc_method_handler(lambda m, c: iter([m])), guard)
    assert single.request_streaming and single.response_streaming
    guard.close()


def test_silent_probes_keep_no_other_from_its_answer() -> None:
    ended = threading.Event()

    def silence() -> Iterator[bytes]:
        ended.wait(60)
        yield from ()

    config = ServerConfig(health="127.0.0.1:0", message_s=0.5)
    with serving(config) as (server, _), grpc.insecure_channel(server.health_address) as channel:
        silent = [
            channel.stream_unary("/grpc.health.v1.Health/Check").future(silence())
            for _ in range(10)
        ]
        with grpc.insecure_channel(server.health_address) as other:
            stub = health_pb2_grpc.HealthStub(other)
            found = stub.Check(health_pb2.HealthCheckRequest(), timeout=30)
        assert found.status == health_pb2.HealthCheckResponse.SERVING
        for future in silent:
            error = future.exception(timeout=30)
            assert isinstance(error, grpc.RpcError) and error.code() is grpc.StatusCode.CANCELLED
        ended.set()
