"""Random damage to files: bytes, words of text, values of JSON-like trees, members of archives."""

import copy
import io
import json
import re
import zipfile
from typing import Any

import numpy as np

from console.bench.fuzzing.files import Sample, headed, pickled
from policy.checkpoints import format as checkpoints
from rpc import codec
from rpc.errors import CodecError
from world.motions.formats import safe_pickle

#: Typical invalid words.
WORDS = (
    b"nan", b"inf", b"-inf", b"1e999", b"-1", b"0", b"99999999999999999999", b"1e30", b"\x00",
    b"\xff\xfe", b"{", b"}", b"[", b"\n", b" ", b"\r", b"#", b":", b"-", b"\xc3\x28", b"",
)  # fmt: skip
VALUES: tuple[Any, ...] = (
    None, True, -1, 0, 1e308, -1e308, 10**30, float("nan"), float("inf"), "", "x", "../x", [], {},
    [[[]]], [1, 2, 3], {"a": 1}, 2**31, -(2**63), 0.5, "nan", [None],
)  # fmt: skip
ARRAYS = (
    np.zeros(0), np.zeros((1, 1, 1)), np.full(3, np.nan), np.array(7.0), np.zeros((12, 3)),
    np.full((12, 34), 1e300), np.zeros((2, 66), np.float32), np.array([True]),
)  # fmt: skip
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?")


def mutated(sample: Sample, seed: int) -> bytes:
    """Return the sample's content with the damage of a seed."""
    draw = np.random.default_rng((7, seed))
    if sample.kind == "zip" and draw.random() < 0.7:
        return _archive(sample.content, draw)
    if sample.kind in _TREES and draw.random() < 0.7:
        return _TREES[sample.kind](sample.content, draw)
    if sample.kind in ("text", "json", "signed") and draw.random() < 0.5:
        return _text(sample.content, draw)
    return _bytes(sample.content, draw)


def _bytes(content: bytes, draw: np.random.Generator) -> bytes:
    data = bytearray(content)
    for _ in range(int(draw.integers(1, 5))):
        size = max(1, len(data))
        at, span = int(draw.integers(size)), int(draw.integers(1, 1 + min(size, 64)))
        match int(draw.integers(7)):
            case 0 if data:
                data[at] ^= 1 << int(draw.integers(8))
            case 1 if data:
                data[at] = int(draw.choice([0, 1, 0x7F, 0x80, 0xFF]))
            case 2:
                del data[at : at + span]
            case 3:
                data[at:at] = data[at : at + span] * int(draw.integers(1, 4))
            case 4:
                del data[at:]
            case 5:
                data[at : at + 4] = bytes(draw.integers(256, size=4).tolist())
            case _:
                data[at:at] = WORDS[int(draw.integers(len(WORDS)))]
    return bytes(data)


def _text(content: bytes, draw: np.random.Generator) -> bytes:
    """Replace numbers, or drop or swap lines."""
    match int(draw.integers(4)):
        case 0 | 1:
            numbers = list(_NUMBER.finditer(content))
            if not numbers:
                return content
            for index in sorted(draw.integers(len(numbers), size=2).tolist(), reverse=True):
                word, number = WORDS[int(draw.integers(len(WORDS)))], numbers[index]
                content = content[: number.start()] + word + content[number.end() :]
            return content
        case 2:
            lines = content.split(b"\n")
            at = int(draw.integers(len(lines)))
            del lines[at : at + int(draw.integers(1, 4))]
            return b"\n".join(lines)
        case _:
            lines = content.split(b"\n")
            one, other = (int(i) for i in draw.integers(len(lines), size=2))
            lines[one], lines[other] = lines[other], lines[one]
            return b"\n".join(lines)


def _archive(content: bytes, draw: np.random.Generator) -> bytes:
    """Damage, drop or replace one member of a valid archive."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = list(members)[int(draw.integers(len(members)))]
    choice = draw.random()
    if choice < 0.1:
        del members[name]
    elif choice < 0.3:
        array = ARRAYS[int(draw.integers(len(ARRAYS)))]
        file = io.BytesIO()
        np.lib.format.write_array(file, array, allow_pickle=False)
        members[name] = file.getvalue()
    else:
        members[name] = _bytes(members[name], draw)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for key, data in members.items():
            # of a fixed date: by its name alone a member has the time of now
            archive.writestr(zipfile.ZipInfo(key), data, zipfile.ZIP_DEFLATED)
    return file.getvalue()


def _json(content: bytes, draw: np.random.Generator) -> bytes:
    return json.dumps(_odd(json.loads(content), draw, VALUES)).encode()


def _signed(content: bytes, draw: np.random.Generator) -> bytes:
    """Return a manifest with other values and a matching digest."""
    table = json.loads(content)
    table.pop("sha256")
    table = _odd(table, draw, VALUES)
    if isinstance(table, dict):
        table["sha256"] = checkpoints.digest_of(table)
    return json.dumps(table).encode()


def _msgpack(content: bytes, draw: np.random.Generator) -> bytes:
    odd = _odd(codec.unpack(content), draw, (*VALUES, *ARRAYS))
    try:
        return codec.pack(odd)
    except CodecError:
        return _bytes(content, draw)


def _pickle(content: bytes, draw: np.random.Generator) -> bytes:
    held = safe_pickle.loaded(content)
    return pickled(_odd(held, draw, (*VALUES, *ARRAYS)))


def _npy(content: bytes, draw: np.random.Generator) -> bytes:
    held = safe_pickle.loaded(content[content.index(b"\n") + 1 :])
    return headed(_odd(held, draw, (*VALUES, *ARRAYS)))


def _odd(tree: Any, draw: np.random.Generator, values: tuple[Any, ...]) -> Any:
    """Return a copy in which one to three values are replaced or removed."""
    root = [copy.deepcopy(tree)]
    for _ in range(int(draw.integers(1, 4))):
        holder: Any = root
        key: Any = 0
        while isinstance(holder[key], dict | list) and holder[key] and draw.random() < 0.85:
            holder = holder[key]
            keys = list(holder) if isinstance(holder, dict) else range(len(holder))
            key = keys[int(draw.integers(len(keys)))]
        if draw.random() < 0.15 and holder is not root:
            del holder[key]
        else:
            holder[key] = copy.deepcopy(values[int(draw.integers(len(values)))])
    return root[0]


_TREES = {
    "json": _json,
    "signed": _signed,
    "msgpack": _msgpack,
    "pickle": _pickle,
    "npy": _npy,
}
