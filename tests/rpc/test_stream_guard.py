"""Calls of many messages: no more than so many at a time, and their messages pass unchanged."""

from types import SimpleNamespace
from typing import Any

import grpc
import pytest

from rpc.errors import RefusedError
from rpc.stream_guard import StreamGuard

CONTEXT: Any = SimpleNamespace(cancel=lambda: None)


def test_no_more_than_so_many_at_a_time() -> None:
    told: list[bool] = []
    guard = StreamGuard(2, 60.0, 60.0, told.append)
    with guard.call(CONTEXT):
        with guard.call(CONTEXT):
            with pytest.raises(RefusedError, match="2 calls of many messages") as caught:
                guard.call(CONTEXT).__enter__()
            assert caught.value.code is grpc.StatusCode.RESOURCE_EXHAUSTED
            assert told == [True]
        assert told == [True, False]
        with guard.call(CONTEXT):
            assert told == [True, False, True]
    guard.close()


def test_messages_pass_unchanged() -> None:
    guard = StreamGuard(1, 60.0, 60.0)
    with guard.call(CONTEXT) as one:
        assert list(guard.requests(iter("abc"), one)) == ["a", "b", "c"]
        assert list(guard.responses(iter(range(3)), one)) == [0, 1, 2]
        assert one.since is None and one.waited >= 0.0 and not one.expired
    guard.close()
