"""Refusals keep the status they came with."""

import grpc

from rpc.errors import CodecError, RefusedError, RpcError, UnreachableError


def test_a_refusal_has_status_and_message() -> None:
    error = RefusedError(grpc.StatusCode.NOT_FOUND, "no such policy")
    assert str(error) == "no such policy" and error.code is grpc.StatusCode.NOT_FOUND
    assert all(issubclass(kind, RpcError) for kind in (CodecError, RefusedError, UnreachableError))
