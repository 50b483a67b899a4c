"""Conversion of rollouts and states to messages of rpc.v1 and back."""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np
import torch
from torch import Tensor

from rpc.chunks import Field, split
from rpc.codec import number_format
from rpc.errors import CodecError
from rpc.v1 import style_pb2 as pb

MAX_ROLLOUT_BYTES = 1 << 28  # of one array
MAX_STATE_BYTES = 4 << 30
MAX_TENSORS = 10_000
MAX_NAME = 200
FORMATS = {pb.NUMBER_FORMAT_FLOAT32: "<f4", pb.NUMBER_FORMAT_FLOAT16: "<f2"}
FIELDS = ("states", "end_index", "end_states", "valid")


def rollout_chunks(
    batch: int,
    version: int | None,
    states: Tensor,
    end_index: Tensor,
    end_states: Tensor,
    valid: Tensor,
    half: bool = False,
) -> list[pb.ScoreChunk]:
    """Messages of a rollout, with layouts as in `Discriminator.score`; half: states as float16."""
    header = pb.ScoreHeader(
        batch=batch,
        steps=states.shape[0] - 1,
        scenes=states.shape[1],
        width=states.shape[2],
        ends=len(end_index),
        format=pb.NUMBER_FORMAT_FLOAT16 if half else pb.NUMBER_FORMAT_FLOAT32,
        version=version,
    )
    kind = np.float16 if half else np.float32
    arrays = {
        "states": states.cpu().numpy().astype(kind, copy=False),
        "end_index": end_index.cpu().numpy(),
        "end_states": end_states.cpu().numpy().astype(kind, copy=False),
        "valid": valid.cpu().numpy().astype(np.uint8),
    }
    chunks = [pb.ScoreChunk(header=header)]
    for name in FIELDS:
        for piece in split(arrays[name]):
            chunk = pb.ScoreChunk()
            setattr(chunk, name, piece)
            chunks.append(chunk)
    return chunks


def rollout_of(
    header: pb.ScoreHeader, chunks: Iterator[pb.ScoreChunk], width: int
) -> dict[str, Tensor]:
    """Arguments of `Discriminator.score` from the chunks that follow a header.

    Raises CodecError, naming the field and its valid form.
    """
    if header.batch < 0:
        raise CodecError(f"header.batch: {header.batch}, must be 0 or more")
    if header.steps < 1 or header.scenes < 1:
        raise CodecError(
            f"header.steps, header.scenes: {header.steps}, {header.scenes}, must be 1 or more"
        )
    if header.width != width:
        raise CodecError(f"header.width: {header.width}, must be {width} (numbers a state)")
    if not 0 <= header.ends <= header.steps * header.scenes:
        raise CodecError(f"header.ends: {header.ends}, must be 0..{header.steps * header.scenes}")
    if header.format not in FORMATS:
        raise CodecError(f"header.format: {header.format}, must be 1 (float32) or 2 (float16)")
    number = FORMATS[header.format]
    shapes = {
        "states": (number, (header.steps + 1, header.scenes, width)),
        "end_index": ("<i8", (header.ends, 2)),
        "end_states": (number, (header.ends, width)),
        "valid": ("|u1", (header.steps, header.scenes)),
    }
    fields = {
        k: Field(k, spelled, shape, MAX_ROLLOUT_BYTES) for k, (spelled, shape) in shapes.items()
    }
    for chunk in chunks:
        part = chunk.WhichOneof("part")
        if part not in fields:
            raise CodecError(f"chunk: {part or 'empty'}, must be one of {', '.join(FIELDS)}")
        fields[part].add(getattr(chunk, part))
    arrays = {name: torch.from_numpy(field.array()) for name, field in fields.items()}
    return {
        "rollout_states": arrays["states"].float(),
        "end_index": arrays["end_index"],
        "end_states": arrays["end_states"].float(),
        "valid": arrays["valid"].bool(),
    }


def state_chunks(state: Mapping[str, Tensor]) -> Iterator[pb.StateChunk]:
    """Messages of a state_dict."""
    yield pb.StateChunk(header=pb.StateHeader(tensors=len(state)))
    for name, tensor in state.items():
        array = tensor.detach().cpu().numpy()
        header = pb.TensorHeader(name=name, format=number_format(array), shape=array.shape)
        yield pb.StateChunk(tensor=header)
        for piece in split(array):
            yield pb.StateChunk(data=piece)


def state_of(
    chunks: Iterable[pb.StateChunk], max_bytes: int = MAX_STATE_BYTES
) -> dict[str, Tensor]:
    """State_dict of messages; CodecError if truncated, out of order or too large."""
    chunks = iter(chunks)
    first = next(chunks, None)
    if first is None or first.WhichOneof("part") != "header":
        raise CodecError("state: must begin with a header")
    count = first.header.tensors
    if not 0 <= count <= MAX_TENSORS:
        raise CodecError(f"header.tensors: {count}, must be 0..{MAX_TENSORS}")
    fields: dict[str, Field] = {}
    field: Field | None = None
    total = 0
    for chunk in chunks:
        part = chunk.WhichOneof("part")
        if part == "tensor":
            header = chunk.tensor
            if header.name in fields:
                raise CodecError(f"state: tensor {header.name} comes twice")
            if len(header.name) > MAX_NAME or len(fields) >= count:
                raise CodecError(
                    f"state: tensor {header.name[:40]}, must be one of {count} with names of at"
                    f" most {MAX_NAME} characters"
                )
            field = Field(header.name, header.format, tuple(header.shape), max_bytes - total)
            fields[header.name] = field
            total += field.size
        elif part == "data" and field is not None:
            field.add(chunk.data)
        else:
            raise CodecError(f"state: {part or 'empty'} out of place, must be a tensor or its data")
    if len(fields) != count:
        raise CodecError(f"state: truncated, {len(fields)} tensors of {count}")
    return {name: torch.from_numpy(field.array()) for name, field in fields.items()}
