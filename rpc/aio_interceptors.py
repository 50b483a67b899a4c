"""Token check, call metrics and error statuses for the handlers of a server on an event loop.

They wrap each behaviour once, when its service is added: gRPC's own interceptors cost a good part
of a small call on an event loop.
"""

import asyncio
import hmac
import time
from collections.abc import Awaitable, Callable
from typing import Any

import grpc
from prometheus_client import CollectorRegistry

from rpc.interceptors import INTERNAL, UNAUTHENTICATED, CallMetrics, Errors, status_of, unexpected
from rpc.malformed import redact

Behaviour = Callable[[Any, grpc.aio.ServicerContext], Awaitable[Any]]
_KINDS = (
    ("unary_unary", grpc.unary_unary_rpc_method_handler),
    ("unary_stream", grpc.unary_stream_rpc_method_handler),
    ("stream_unary", grpc.stream_unary_rpc_method_handler),
    ("stream_stream", grpc.stream_stream_rpc_method_handler),
)


def rewrap(
    handler: grpc.RpcMethodHandler, wrap: Callable[[Behaviour], Behaviour]
) -> grpc.RpcMethodHandler:
    """Handler with the same codecs and a wrapped behaviour."""
    for kind, make in _KINDS:
        behaviour = getattr(handler, kind)
        if behaviour is not None:
            return make(
                wrap(behaviour),
                request_deserializer=handler.request_deserializer,
                response_serializer=handler.response_serializer,
            )
    raise AssertionError("a handler without behaviour")


def require_token(token: str, behaviour: Behaviour) -> Behaviour:
    """Behaviour that refuses calls without the bearer token; compares in constant time."""
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
        async for reply in found:  # a behaviour that is an async generator, such as reflection's
            await context.write(reply)

    return guarded


class CallWatch:
    """Call metrics, and statuses with one-line messages for expected exceptions.

    Behaviours must be coroutines that raise rather than abort; a streaming behaviour writes its
    replies to the context.
    """

    def __init__(self, registry: CollectorRegistry, errors: Errors) -> None:
        """errors: status of each expected exception type; any other one becomes INTERNAL."""
        self._errors = errors
        self._metrics = CallMetrics(registry)

    def wrap(self, method: str, behaviour: Behaviour) -> Behaviour:
        """Wrapped behaviour of a method (`/package.Service/Method`)."""
        metrics, clock = self._metrics, time.monotonic
        done = metrics.recorder(method, grpc.StatusCode.OK)

        async def watched(request: Any, context: grpc.aio.ServicerContext) -> Any:
            began = clock()
            try:
                reply = await behaviour(request, context)
            except asyncio.CancelledError:
                left = context.time_remaining()
                expired = left is not None and left <= 0
                code = grpc.StatusCode.DEADLINE_EXCEEDED if expired else grpc.StatusCode.CANCELLED
                metrics.record(method, code, clock() - began)
                raise
            except Exception as error:
                code = status_of(error, self._errors)
                if code is INTERNAL and context.cancelled():  # caused by the client's cancellation
                    metrics.record(method, grpc.StatusCode.CANCELLED, clock() - began)
                    raise asyncio.CancelledError from error
                metrics.record(method, code, clock() - began)
                await context.abort(
                    code, redact(unexpected(error) if code is INTERNAL else str(error))
                )
            else:
                done(clock() - began)
                return reply

        return watched
