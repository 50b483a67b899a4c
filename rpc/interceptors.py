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

HEALTH = "/grpc.health.v1.Health/"  # probes carry no token
Continuation = Callable[[grpc.HandlerCallDetails], grpc.RpcMethodHandler | None]


class TokenInterceptor(grpc.ServerInterceptor):
    """Lets only calls with the bearer token pass; compares in constant time."""

    def __init__(self, token: str) -> None:
        """`token`: printable ASCII."""
        self._expected = f"Bearer {token}".encode()

        def refuse(_request: Any, context: grpc.ServicerContext) -> None:
            context.abort(
                grpc.StatusCode.UNAUTHENTICATED, "authorization: must be 'Bearer <the token>'"
            )

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
        self, registry: CollectorRegistry, errors: Mapping[type[Exception], grpc.StatusCode]
    ) -> None:
        """`errors`: the status of each expected exception; unexpected ones become INTERNAL."""
        self._errors = {CodecError: grpc.StatusCode.INVALID_ARGUMENT, **errors}
        self._calls = Counter("rpc_calls", "Calls.", ["method", "code"], registry=registry)
        self._seconds = Histogram("rpc_seconds", "Call times.", ["method"], registry=registry)

    def intercept_service(
        self, continuation: Continuation, handler_call_details: grpc.HandlerCallDetails
    ) -> grpc.RpcMethodHandler | None:
        """The handler with its behaviour wrapped."""
        handler = continuation(handler_call_details)
        method = handler_call_details.method or ""
        if handler is None or method.startswith(("/grpc.health.", "/grpc.reflection.")):
            return handler
        behaviour: Any = (
            handler.unary_unary
            or handler.unary_stream
            or handler.stream_unary
            or handler.stream_stream
        )

        def reply(request: Any, context: grpc.ServicerContext) -> Any:
            with self._watched(method, context):
                return behaviour(request, context)

        def stream(request: Any, context: grpc.ServicerContext) -> Iterator[Any]:
            with self._watched(method, context):
                yield from behaviour(request, context)

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
            code = self._code(error)
            message = str(error)
            if code is grpc.StatusCode.INTERNAL:
                if not context.is_active():
                    code = grpc.StatusCode.CANCELLED
                    raise
                traceback.print_exc()
                message = f"{type(error).__name__}: {error}"
            context.abort(code, message)
        finally:
            self._calls.labels(method, code.name).inc()
            self._seconds.labels(method).observe(time.monotonic() - began)

    def _code(self, error: Exception) -> grpc.StatusCode:
        if isinstance(error, RefusedError):
            return error.code
        for kind, code in self._errors.items():
            if isinstance(error, kind):
                return code
        return grpc.StatusCode.INTERNAL
