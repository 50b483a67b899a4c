"""Calls of a single message whose wait for it is bounded.

gRPC gives such a call a worker before its message is there, and lets it wait for ever: as many
silent calls as there are workers would stop a synchronous server. On the wire a single message is a
stream of one, so these calls are handled as streams and waited for with a limit.
"""

from collections.abc import Callable, Iterator
from typing import Any

import grpc

from rpc.errors import CodecError
from rpc.stream_guard import StreamGuard

#: Marks of a behaviour that answers later, from a pool of its own.
_MARKS = ("experimental_non_blocking", "experimental_thread_pool")


def bounded(
    handler: grpc.RpcMethodHandler, guard: StreamGuard, refuse: bool = False
) -> grpc.RpcMethodHandler:
    """The handler, with a wait for its single message that `guard` bounds; handlers of streams are
    unchanged.

    Where the client ends without a message, its behaviour raises CodecError or, with `refuse`,
    answers INVALID_ARGUMENT by itself: for services that no CallInterceptor watches.
    """
    if handler.request_streaming:
        return handler
    behaviour: Any = handler.unary_stream if handler.response_streaming else handler.unary_unary

    def reply(messages: Iterator[Any], context: grpc.ServicerContext, *more: Any) -> Any:
        with guard.call(context) as one:
            message = next(guard.requests(messages, one), None)
        if message is None:
            error = CodecError("message: missing")
            if not refuse:
                raise error
            context.abort(grpc.StatusCode.INVALID_ARGUMENT, str(error))
        return behaviour(message, context, *more)

    for name in _MARKS:
        if hasattr(behaviour, name):
            setattr(reply, name, getattr(behaviour, name))
    make = (
        grpc.stream_stream_rpc_method_handler
        if handler.response_streaming
        else grpc.stream_unary_rpc_method_handler
    )
    return make(
        reply,
        request_deserializer=handler.request_deserializer,
        response_serializer=handler.response_serializer,
    )


class FirstMessageInterceptor(grpc.ServerInterceptor):
    """Bounds the wait for single messages on a server that nothing else watches."""

    def __init__(self, guard: StreamGuard) -> None:
        self._guard = guard

    def intercept_service(
        self,
        continuation: Callable[[grpc.HandlerCallDetails], grpc.RpcMethodHandler | None],
        handler_call_details: grpc.HandlerCallDetails,
    ) -> grpc.RpcMethodHandler | None:
        """The handler, bounded."""
        handler = continuation(handler_call_details)
        return None if handler is None else bounded(handler, self._guard, refuse=True)
