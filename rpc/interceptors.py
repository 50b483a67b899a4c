"""Interceptors of a server: token check, call metrics and error statuses."""

import hmac
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

import grpc
from prometheus_client import CollectorRegistry, Counter, Histogram

from rpc.errors import CodecError, RefusedError
from rpc.first_message import bounded
from rpc.malformed import defer_parse_errors, redact
from rpc.stream_guard import StreamGuard

HEALTH = "/grpc.health.v1.Health/"  # needs no token, which health probes do not send
UNAUTHENTICATED = "authorization: must be 'Bearer <the token>'"
Continuation = Callable[[grpc.HandlerCallDetails], grpc.RpcMethodHandler | None]


class CallMetrics:
    """Counts and durations of calls by method."""

    def __init__(self, registry: CollectorRegistry) -> None:
        self._calls = Counter("rpc_calls", "Calls.", ["method", "code"], registry=registry)
        self._seconds = Histogram("rpc_seconds", "Call times.", ["method"], registry=registry)

    def recorder(self, method: str, code: grpc.StatusCode) -> Callable[[float], None]:
        """Function that records a call by its seconds; its labels are looked up only once."""
        count, observe = self._calls.labels(method, code.name).inc, self._seconds.labels(method)

        def add(seconds: float) -> None:
            count()
            observe.observe(seconds)

        return add

    def record(self, method: str, code: grpc.StatusCode, seconds: float) -> None:
        """Record a call that has ended."""
        self.recorder(method, code)(seconds)


Errors = Mapping[type[Exception], grpc.StatusCode]


def status_of(error: Exception, errors: Errors) -> grpc.StatusCode:
    """Status of an exception: its own, that of its type, or INTERNAL if it is unexpected."""
    if isinstance(error, RefusedError):
        return error.code
    for kind, code in errors.items():
        if isinstance(error, kind):
            return code
    return grpc.StatusCode.INVALID_ARGUMENT if isinstance(error, CodecError) else INTERNAL


def unexpected(error: Exception) -> str:
    """One line about an unexpected exception, for the caller; the traceback goes to stderr."""
    with suppress(OSError):  # nobody may read it any more
        traceback.print_exception(error)
    return f"{type(error).__name__}: {error}"


INTERNAL = grpc.StatusCode.INTERNAL


class TokenInterceptor(grpc.ServerInterceptor):
    """Refuses calls without the bearer token; compares in constant time."""

    def __init__(self, token: str) -> None:
        """token: printable ASCII."""
        self._expected = f"Bearer {token}".encode()

        def refuse(_request: Any, context: grpc.ServicerContext) -> None:
            context.abort(grpc.StatusCode.UNAUTHENTICATED, UNAUTHENTICATED)

        self._refusal = grpc.unary_unary_rpc_method_handler(refuse)

    def intercept_service(
        self, continuation: Continuation, handler_call_details: grpc.HandlerCallDetails
    ) -> grpc.RpcMethodHandler | None:
        """The handler, or a handler that refuses the call."""
        shown = dict(handler_call_details.invocation_metadata or ()).get("authorization", "")
        shown = shown.encode() if isinstance(shown, str) else shown
        method = handler_call_details.method or ""
        if hmac.compare_digest(shown, self._expected) or method.startswith(HEALTH):
            return continuation(handler_call_details)
        return self._refusal


class CallInterceptor(grpc.ServerInterceptor):
    """Call metrics, and statuses with one-line messages for expected exceptions."""

    def __init__(
        self,
        registry: CollectorRegistry,
        errors: Errors,
        guard: StreamGuard | None = None,
        first: StreamGuard | None = None,
    ) -> None:
        """errors: status of each expected exception type; any other one becomes INTERNAL.
        guard: bounds streaming calls, including those of reflection. first: bounds the wait of
        other calls for their single message, health checks too."""
        self._errors = errors
        self._guard, self._first = guard, first
        self._metrics = CallMetrics(registry)

    def intercept_service(
        self, continuation: Continuation, handler_call_details: grpc.HandlerCallDetails
    ) -> grpc.RpcMethodHandler | None:
        """The handler with a wrapped behaviour."""
        handler = continuation(handler_call_details)
        method = handler_call_details.method or ""
        if handler is None:
            return handler
        health, streaming = method.startswith("/grpc.health."), handler.request_streaming
        if not health:
            handler = defer_parse_errors(handler)
        if self._first is not None:
            handler = bounded(handler, self._first, refuse=health)
        if health:
            return handler
        behaviour: Any = (
            handler.unary_unary
            or handler.unary_stream
            or handler.stream_unary
            or handler.stream_stream
        )

        guard = self._guard

        def reply(request: Any, context: grpc.ServicerContext) -> Any:
            with self._watched(method, context):
                if guard is None or not streaming:
                    return behaviour(request, context)
                with guard.call(context) as one:
                    return behaviour(guard.requests(request, one), context)

        def stream(request: Any, context: grpc.ServicerContext) -> Iterator[Any]:
            with self._watched(method, context):
                if guard is None:
                    yield from behaviour(request, context)
                    return
                with guard.call(context) as one:
                    if streaming:
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
        except GeneratorExit:  # the client cancelled the stream
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
            context.abort(code, redact(message))
        finally:
            self._metrics.record(method, code, time.monotonic() - began)
