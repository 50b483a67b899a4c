"""Errors of gRPC as one line."""

import grpc
import pytest

from inhabit_client.errors import ServiceError, told


def test_an_error_without_a_call_is_told_too() -> None:
    with pytest.raises(ServiceError) as caught, told():
        raise grpc.RpcError("a\nb")
    assert str(caught.value) == "UNKNOWN: a b"


def test_other_errors_pass() -> None:
    with pytest.raises(KeyError), told():
        raise KeyError("x")
