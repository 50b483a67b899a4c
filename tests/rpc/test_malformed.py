"""Bytes that are no message, and words for callers without folders."""

import grpc
import pytest
from google.protobuf.message import DecodeError

from rpc.errors import CodecError
from rpc.malformed import LONGEST, defer_parse_errors, redact


def test_bytes_that_are_no_message_are_refused_when_read() -> None:
    def parse(data: bytes) -> str:
        raise DecodeError("truncated")

    request = defer_parse_errors(
        grpc.unary_unary_rpc_method_handler(print, parse)
    ).request_deserializer(b"x")
    with pytest.raises(CodecError, match=r"^message: cannot be parsed \(truncated\)$"):
        request.batch  # noqa: B018


def test_words_for_callers_have_no_folders_and_an_end() -> None:
    said = "cannot read /srv/runs/sit-1/checkpoints/000002/policy.safetensors: gone\nline two"
    assert redact(said) == "cannot read policy.safetensors: gone line two"
    assert redact("FileNotFoundError: '/home/ada/x.npz'") == "FileNotFoundError: 'x.npz'"
    for plain in ("at most 3 rad/s", "style/loss is nan", "1/2 of 3/4", "network/layers.0.weight"):
        assert redact(plain) == plain
    assert len(redact("x" * 10_000_000)) == LONGEST + 3
