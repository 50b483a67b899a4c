"""Malformed requests, and error texts that are safe to send to a caller."""

import re
from typing import Any, cast

import grpc
from google.protobuf.message import DecodeError

from rpc.errors import CodecError

_FOLDERS = re.compile(r"(?<![\w./])(?:/[^\s/:'\"]+)+/(?=[^\s/])")
LONGEST = 1000
"""Most characters of an error text for a caller: names in it may be as long as its message."""


class Malformed:
    """Stand-in for bytes that are no message: any access to a field raises CodecError."""

    def __init__(self, why: str) -> None:
        self.__dict__["why"] = why

    def __getattr__(self, name: str) -> Any:
        raise CodecError(f"message: cannot be parsed ({self.__dict__['why']})")


def defer_parse_errors(handler: grpc.RpcMethodHandler) -> grpc.RpcMethodHandler:
    """Handler whose parse errors are raised in its behaviour, as INVALID_ARGUMENT.

    gRPC itself answers a parse error with INTERNAL.
    """
    parse = handler.request_deserializer
    if parse is None:
        return handler

    def parsed(data: bytes) -> Any:
        try:
            return parse(data)
        except DecodeError as error:
            return Malformed(str(error))

    return cast(grpc.RpcMethodHandler, handler._replace(request_deserializer=parsed))


def redact(text: str) -> str:
    """Error text for a caller: one line of bounded length, paths without their folders."""
    plain = _FOLDERS.sub("", " ".join(text.split()))
    return plain if len(plain) <= LONGEST else f"{plain[:LONGEST]}..."
