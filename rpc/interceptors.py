"""What happens to every call of a server: token check, counting, and errors made statuses."""

import hmac
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import grpc
from prometheus_client import CollectorRegistry, Counter, Histogram

from rpc.errors import CodecError, RefusedError
from rpc.malformed import forgiving, public
from rpc.stream_guard import StreamGuard

HEALTH = "/grpc.health.v1.Health/"  # probes carry no token
UNAUTHENTICATED = "authorization: must be 'Bearer <the token>'"
Continuation = Callable[[grpc.HandlerCallDetails], grpc.RpcMethodHandler | None]


class CallMetrics:
    """Calls and their times by method."""

    def __init__(self, registry: CollectorRegistry) -> None:
        self._calls = Counter("rpc_calls", "Calls.", ["method", "code"], registry=registry)
        self._seconds = Histogram("rpc_seconds", "Call times.", ["method"], registry=registry)

    def adder(self, method: str, code: grpc.StatusCode) -> Callable[[float], None]:
        """Adds a call that ended so, given its seconds; found once, it is quick."""
        count, observe = self._calls.labels(method, code.name).inc, self._seconds.labels(method)

        def add(seconds: float) -> None:
            count()
            observe.observe(seconds)

        return add

    def add(self, method: str, code: grpc.StatusCode, seconds: float) -> None:
        """One more call that ended."""
        self.adder(method, code)(seconds)


Errors = Mapping[type[Exception], grpc.StatusCode]


def status_of(error: Exception, errors: Errors) -> grpc.StatusCode:
    """The status of an exception: its own, that of its type, or INTERNAL if it is unexpected."""
    if isinstance(error, RefusedError):
        return error.code
    for kind, code in errors.items():
        if isinstance(error, kind):
            return code
    return grpc.StatusCode.INVALID_ARGUMENT if isinstance(error, CodecError) else INTERNAL


def unexpected(error: Exception) -> str:
    """One line for the caller about an exception that nobody foresaw; the rest goes to stderr."""
    traceback.print_exception(error)
    return f"{type(error).__name__}: {error}"


INTERNAL = grpc.StatusCode.INTERNAL


class TokenInterceptor(grpc.ServerInterceptor):
    """Lets only calls with the bearer token pass; compares in constant time."""

    def __init__(self, token: str) -> None:
        """`token`: printable ASCII."""
        self._expected = f"Bearer {token}".encode()

        def refuse(_request: Any, context: grpc.ServicerContext) -> None:
            context.abort(grpc.StatusCode.UNAUTHENTICATED, UNAUTHENTICATED)

        self._refusal = grpc.unary_unary_rpc_method_handler(refuse)

    def intercept_service(
        self, continuation: Continuation, handler_call_details: grpc.HandlerCallDetails
    ) -> grpc.RpcMethodHandler | None:
        """The handler itself, or a refusal."""
        shown = dict(handler_call_details.invocation_metadata or ()).get("authorization", "")
        shown = shown.encode() if isinstance(shown, str) else shown
        method = handler_call_details.method or ""
        if hmac.compare_digest(shown, self._expected) or method.startswith(HEALTH):
            return continuation(handler_call_details)
        return self._refusal


class CallInterceptor(grpc.ServerInterceptor):
    """Counts and times calls, and gives expected exceptions their status and one-line message."""

    def __init__(
        self, registry: CollectorRegistry, errors: Errors, guard: StreamGuard | None = None
    ) -> None:
        """`errors`: the status of each expected exception; unexpected ones become INTERNAL.
        `guard`: bounds the calls of many messages, those of reflection too."""
        self._errors = errors
        self._guard = guard
        self._metrics = CallMetrics(registry)

    def intercept_service(
        self, continuation: Continuation, handler_call_details: grpc.HandlerCallDetails
    ) -> grpc.RpcMethodHandler | None:
        """The handler with its behaviour wrapped."""
        handler = continuation(handler_call_details)
        method = handler_call_details.method or ""
        if handler is None or method.startswith("/grpc.health."):
            return handler
        handler = forgiving(handler)
        behaviour: Any = (
            handler.unary_unary
            or handler.unary_stream
            or handler.stream_unary
            or handler.stream_stream
        )

        guard = self._guard

        def reply(request: Any, context: grpc.ServicerContext) -> Any:
            with self._watched(method, context):
                if guard is None or not handler.request_streaming:
                    return behaviour(request, context)
                with guard.call(context) as one:
                    return behaviour(guard.requests(request, one), context)

        def stream(request: Any, context: grpc.ServicerContext) -> Iterator[Any]:
            with self._watched(method, context):
                if guard is None:
                    yield from behaviour(request, context)
                    return
                with guard.call(context) as one:
                    if handler.request_streaming:
                        request = guard.requests(request, one)
                    yield from guard.responses(behaviour(request, context), one)

        make = {
            (False, False): grpc.unary_unary_rpc_method_handler,
            (False, True): grpc.unary_stream_rpc_method_handler,
            (True, False): grpc.stream_unary_rpc_method_handler,
            (True, True): grpc.stream_stream_rpc_method_handler,
        }[handler.request_streaming, handler.response_streaming]
        return make(
            stream if handler.response_streaming else reply,
            request_deserializer=handler.request_deserializer,
            response_serializer=handler.response_serializer,
        )

    @contextmanager
    def _watched(self, method: str, context: grpc.ServicerContext) -> Iterator[None]:
        began, code = time.monotonic(), grpc.StatusCode.OK
        try:
            yield
        except GeneratorExit:  # the client went away in the middle of a stream
            code = grpc.StatusCode.CANCELLED
            raise
        except Exception as error:
            code = status_of(error, self._errors)
            message = str(error)
            if code is INTERNAL:
                if not context.is_active():
                    code = grpc.StatusCode.CANCELLED
                    raise
                message = unexpected(error)
            context.abort(code, public(message))
        finally:
            self._metrics.add(method, code, time.monotonic() - began)
