"""Errors of calls, in one line each."""

from collections.abc import Iterator
from contextlib import contextmanager

import grpc


class ServiceError(Exception):
    """A call that the service refused, or that did not reach it."""

    def __init__(self, code: str, text: str) -> None:
        super().__init__(f"{code}: {text}")
        self.code = code
        """gRPC's status, such as INVALID_ARGUMENT, NOT_FOUND or UNAVAILABLE."""
        self.text = text
        """What the service says, which names the wrong field and the valid choices."""


@contextmanager
def told() -> Iterator[None]:
    """Within it, errors of gRPC are raised as ServiceError."""
    try:
        yield
    except grpc.RpcError as error:
        if not isinstance(error, grpc.Call):
            raise ServiceError("UNKNOWN", " ".join(str(error).split())) from error
        text = " ".join((error.details() or "no details").split())
        raise ServiceError(error.code().name, text) from error
