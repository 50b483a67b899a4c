"""Token check, counting and statuses of errors, round the handlers of a server on an event loop.

gRPC's own interceptors cost a good part of a small call on an event loop; a behaviour that was
wrapped once, when its service was added, costs little.
"""

import asyncio
import hmac
import time
from collections.abc import Awaitable, Callable
from typing import Any

import grpc
from prometheus_client import CollectorRegistry

from rpc.interceptors import INTERNAL, UNAUTHENTICATED, CallMetrics, Errors, status_of, unexpected
from rpc.malformed import public

Behaviour = Callable[[Any, grpc.aio.ServicerContext], Awaitable[Any]]
_KINDS = (
    ("unary_unary", grpc.unary_unary_rpc_method_handler),
    ("unary_stream", grpc.unary_stream_rpc_method_handler),
    ("stream_unary", grpc.stream_unary_rpc_method_handler),
    ("stream_stream", grpc.stream_stream_rpc_method_handler),
)


def rewrapped(
    handler: grpc.RpcMethodHandler, wrap: Callable[[Behaviour], Behaviour]
) -> grpc.RpcMethodHandler:
    """The handler with another behaviour."""
    for kind, make in _KINDS:
        behaviour = getattr(handler, kind)
        if behaviour is not None:
            return make(
                wrap(behaviour),
                request_deserializer=handler.request_deserializer,
                response_serializer=handler.response_serializer,
            )
    raise AssertionError("a handler without behaviour")


def asking_for(token: str, behaviour: Behaviour) -> Behaviour:
    """The behaviour for those who show the bearer token, compared in constant time."""
    expected = f"Bearer {token}".encode()

    def shown(context: grpc.aio.ServicerContext) -> bytes:
        for key, value in context.invocation_metadata() or ():
            if key == "authorization":
                return value if isinstance(value, bytes) else value.encode()
        return b""

    async def guarded(request: Any, context: grpc.aio.ServicerContext) -> Any:
        if not hmac.compare_digest(shown(context), expected):
            await context.abort(grpc.StatusCode.UNAUTHENTICATED, UNAUTHENTICATED)
        found: Any = behaviour(request, context)
        if not hasattr(found, "__aiter__"):
            return await found
        async for reply in found:  # of services that answer with generators, as reflection does
            await context.write(reply)

    return guarded


class Watch:
    """Counts and times calls, and gives expected exceptions their status and one-line message.

    Behaviours must be coroutines (those that answer with a stream write to the context) and raise
    rather than abort.
    """

    def __init__(self, registry: CollectorRegistry, errors: Errors) -> None:
        """`errors`: the status of each expected exception; unexpected ones become INTERNAL."""
        self._errors = errors
        self._metrics = CallMetrics(registry)

    def over(self, method: str, behaviour: Behaviour) -> Behaviour:
        """The behaviour of a method (`/package.Service/Method`), watched."""
        metrics, clock = self._metrics, time.monotonic
        done = metrics.adder(method, grpc.StatusCode.OK)

        async def watched(request: Any, context: grpc.aio.ServicerContext) -> Any:
            began = clock()
            try:
                reply = await behaviour(request, context)
            except asyncio.CancelledError:
                left = context.time_remaining()
                late = left is not None and left <= 0
                code = grpc.StatusCode.DEADLINE_EXCEEDED if late else grpc.StatusCode.CANCELLED
                metrics.add(method, code, clock() - began)
                raise
            except Exception as error:
                code = status_of(error, self._errors)
                if code is INTERNAL and context.cancelled():  # it failed because the client left
                    metrics.add(method, grpc.StatusCode.CANCELLED, clock() - began)
                    raise asyncio.CancelledError from error
                metrics.add(method, code, clock() - began)
                await context.abort(
                    code, public(unexpected(error) if code is INTERNAL else str(error))
                )
            else:
                done(clock() - began)
                return reply

        return watched
