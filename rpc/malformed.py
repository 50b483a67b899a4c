"""Bytes that are no message, and words of errors that are nobody else's business."""

import re
from typing import Any, cast

import grpc
from google.protobuf.message import DecodeError

from rpc.errors import CodecError

_FOLDERS = re.compile(r"(?<![\w./])(?:/[^\s/:'\"]+)+/(?=[^\s/])")
LONGEST = 1000
"""Characters of a refusal that a caller gets: names in it may be as long as its message."""


class Malformed:
    """Stands for bytes that are no message: a CodecError as soon as one looks into it."""

    def __init__(self, why: str) -> None:
        self.__dict__["why"] = why

    def __getattr__(self, name: str) -> Any:
        raise CodecError(f"message: cannot be parsed ({self.__dict__['why']})")


def forgiving(handler: grpc.RpcMethodHandler) -> grpc.RpcMethodHandler:
    """The handler with a parser that never fails, so that its caller gets a status worth having."""
    parse = handler.request_deserializer
    if parse is None:
        return handler

    def parsed(data: bytes) -> Any:
        try:
            return parse(data)
        except DecodeError as error:
            return Malformed(str(error))

    return cast(grpc.RpcMethodHandler, handler._replace(request_deserializer=parsed))


def public(text: str) -> str:
    """An error's words for a caller: one line of bounded length, files without their folders."""
    plain = _FOLDERS.sub("", " ".join(text.split()))
    return plain if len(plain) <= LONGEST else f"{plain[:LONGEST]}..."
