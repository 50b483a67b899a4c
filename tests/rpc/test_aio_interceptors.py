"""Handlers on an event loop: statuses, counts and the token."""

import asyncio
from typing import Any

import grpc
import pytest
from prometheus_client import CollectorRegistry

from rpc.aio_interceptors import CallWatch, require_token, rewrap
from rpc.errors import CodecError


class Aborted(Exception):
    """What a context raises when a handler aborts."""


class Context:
    """A call's context that records how it was aborted."""

    def __init__(self, *metadata: tuple[str, str]) -> None:
        self._metadata = metadata

    def invocation_metadata(self) -> tuple[tuple[str, str], ...]:
        return self._metadata

    def cancelled(self) -> bool:
        return False

    def time_remaining(self) -> float:
        return 0.0

    async def abort(self, code: grpc.StatusCode, details: str) -> None:
        raise Aborted(code, details)


async def doubled(request: int, context: Any) -> int:
    return 2 * request


def test_a_handler_keeps_its_kind_and_codecs() -> None:
    handler = grpc.stream_unary_rpc_method_handler(doubled, str, int)
    found = rewrap(handler, lambda behaviour: lambda r, c: behaviour(r + 1, c))
    assert found.request_streaming and not found.response_streaming
    assert (found.request_deserializer, found.response_serializer) == (str, int)
    assert asyncio.run(found.stream_unary(3, None)) == 8


def test_the_token_is_compared_whole() -> None:
    guarded = require_token("secret", doubled)
    assert asyncio.run(guarded(4, Context(("authorization", "Bearer secret")))) == 8
    for shown in ((), (("authorization", "Bearer secre"),), (("authorization", "secret"),)):
        with pytest.raises(Aborted) as caught:
            asyncio.run(guarded(4, Context(*shown)))
        assert caught.value.args[0] is grpc.StatusCode.UNAUTHENTICATED


def test_calls_are_counted_by_how_they_end() -> None:
    async def failing(request: int, context: Any) -> int:
        raise (KeyError, LookupError, CodecError)[request]("so")

    async def cancelled(request: int, context: Any) -> int:
        raise asyncio.CancelledError

    registry = CollectorRegistry()
    watch = CallWatch(registry, {KeyError: grpc.StatusCode.NOT_FOUND})
    assert asyncio.run(watch.wrap("/s/Good", doubled)(1, Context())) == 2
    codes = ("NOT_FOUND", "INTERNAL", "INVALID_ARGUMENT")
    for request, code in enumerate(codes):
        with pytest.raises(Aborted) as caught:
            asyncio.run(watch.wrap("/s/Bad", failing)(request, Context()))
        assert caught.value.args[0].name == code
    with pytest.raises(asyncio.CancelledError):
        asyncio.run(watch.wrap("/s/Late", cancelled)(0, Context()))

    def count(method: str, code: str) -> float | None:
        return registry.get_sample_value("rpc_calls_total", {"method": method, "code": code})

    assert count("/s/Good", "OK") == 1
    assert [count("/s/Bad", code) for code in codes] == [1, 1, 1]
    assert count("/s/Late", "DEADLINE_EXCEEDED") == 1
