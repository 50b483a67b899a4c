"""Arrays as streams of small messages, and what does not come together."""

import numpy as np
import pytest

from rpc.chunks import Field, split
from rpc.errors import CodecError


def test_chunks_are_small_and_come_together_again() -> None:
    array = np.arange(1000, dtype=np.float32).reshape(10, 100)
    pieces = list(split(array, limit=999))
    assert max(map(len, pieces)) == 999
    field = Field("states", "<f4", (10, 100), 1 << 20)
    for piece in pieces[:-1]:
        field.add(piece)
    with pytest.raises(CodecError, match=r"states: 3996 bytes, must be 4000 \(<f4 \[10, 100\]\)"):
        field.array()
    field.add(pieces[-1])
    assert np.array_equal(field.array(), array)
    with pytest.raises(CodecError, match="more than 4000"):
        field.add(b"1234")
    with pytest.raises(CodecError, match="at most"):
        Field("states", "<f4", (1 << 40, 4), 1 << 20)
    with pytest.raises(CodecError, match="format"):
        Field("states", "|O", (1,), 1 << 20)
    assert list(split(np.empty((0, 3), np.float32))) == []
