"""Arrays through msgpack and through streams of chunks; what is foreign is refused."""

import msgpack
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from rpc.codec import ARRAY, FORMATS, pack, unpack
from rpc.errors import CodecError


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(sorted(FORMATS)).flatmap(
        lambda f: hnp.arrays(f, hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=5))
    )
)
def test_arrays_come_back_bit_for_bit(array: np.ndarray) -> None:
    back = unpack(pack({"a": array}))["a"]
    assert back.dtype == array.dtype
    assert back.shape == array.shape
    assert back.tobytes() == array.tobytes()


def test_nested_messages_tensors_and_byte_orders() -> None:
    big = np.arange(3, dtype=">f4")
    message = {"x": [1, 2.5, "a", None, True, b"\0"], 3: np.float32(0.5), "t": torch.eye(2)}
    back = unpack(pack(message | {"big": big, "strided": np.arange(6).reshape(2, 3).T}))
    assert back["x"] == [1, 2.5, "a", None, True, b"\0"]
    assert back[3] == 0.5
    assert back["t"].tolist() == [[1, 0], [0, 1]]
    assert back["big"].tolist() == [0, 1, 2]
    assert back["big"].dtype.str == "<f4"
    assert back["strided"].tolist() == [[0, 3], [1, 4], [2, 5]]
    back["t"][0, 0] = 7  # writable


@pytest.mark.parametrize("value", [np.array([object()]), object(), {1, 2}, np.array(["a"]), 2**70])
def test_what_is_no_number_is_not_packed(value: object) -> None:
    with pytest.raises(CodecError):
        pack({"v": value})


def test_foreign_and_truncated_bytes_are_refused_in_one_line() -> None:
    good = pack([np.arange(10)])
    for wrong in (
        good[:-1],
        b"",
        b"\xc1",
        good + b"x",
        msgpack.packb(msgpack.ExtType(5, b"pickle")),
        msgpack.packb(msgpack.ExtType(ARRAY, b"<f")),
        msgpack.packb(msgpack.ExtType(ARRAY, b"|O8\x01" + (1).to_bytes(8, "little") + b"x" * 8)),
        # A shape that promises 2^62 numbers must not be allocated.
        msgpack.packb(msgpack.ExtType(ARRAY, b"<f4\x01" + (2**62).to_bytes(8, "little"))),
        msgpack.packb(msgpack.ExtType(ARRAY, b"<f4\x09" + b"\0" * 72)),
    ):
        with pytest.raises(CodecError) as caught:
            unpack(wrong)
        assert "\n" not in str(caught.value)
    with pytest.raises(CodecError, match="at most 8"):
        unpack(good, max_bytes=8)
