"""Checkpoints: directories of safetensors files and one manifest, written atomically."""

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file
from torch import Tensor

from policy.errors import CheckpointError, LayoutError
from world.partial_files import replacing_folder
from world.placeholders import pointer, read_bounded
from world.refusals import refusing

FORMAT = 2
READABLE = (1, 2)  # the manifest of format 1 has no digest of its own
MANIFEST = "manifest.json"
MAX_MANIFEST_BYTES = 64 << 20
MAX_WIDTH, MAX_LAYERS, MAX_FIELDS = 16_384, 16, 1024
"""Largest width, number of layers and number of fields of a network that is read."""
MAX_WEIGHTS = 100_000_000
SECTIONS = ("policy", "training", "style")
State = dict[str, Any]
Table = tuple[tuple[str, int], ...]
"""Names and widths, in order."""


@dataclass(frozen=True)
class Layout:
    """Task, features, goal, actions and network shape of a checkpoint.

    A checkpoint of one layout cannot be loaded as another.
    """

    task: str
    features: Table
    goal: Table
    actions: int
    hidden: tuple[int, ...]
    skip: bool = False
    """Whether the actor has a linear map beside its layers."""

    @property
    def observation(self) -> int:
        """Width of (state, goal)."""
        return sum(width for _, width in (*self.features, *self.goal))

    def require(self, other: "Layout", where: str) -> None:
        """Raise LayoutError, naming the first difference, unless `other` equals this layout."""
        if self.skip != other.skip:
            has, do = ("a", "add") if other.skip else ("no", "leave out")
            raise LayoutError(
                f"{where}: its actor has {has} linear map beside its layers: {do} --ppo.skip"
            )
        for name in ("features", "goal", "actions", "hidden"):
            mine, theirs = getattr(self, name), getattr(other, name)
            if mine != theirs:
                older = name == "goal" and self.task == other.task
                raise LayoutError(
                    f"{where}: its {name} are {_show(theirs)}, this task's are {_show(mine)}"
                    + ("; `train --init` carries its networks over" if older else "")
                )


@dataclass(frozen=True)
class Manifest:
    """Layout and counters of a checkpoint, readable without its tensors."""

    layout: Layout
    iteration: int
    samples: int
    notes: dict[str, str] = field(default_factory=dict)
    """Licence and training data of the weights, by name."""


@dataclass(frozen=True)
class Checkpoint:
    """A loaded checkpoint: its manifest and the sections that were read."""

    path: Path
    manifest: Manifest
    state: State


def flatten(state: Mapping[str, Any], prefix: str = "") -> tuple[dict[str, Tensor], State]:
    """Tensors and JSON values of a nested dict, by path "a/b/c"; an empty dict is a value.

    A slash within a key is written ~1 and a tilde ~0 (RFC 6901). Raises CheckpointError for keys
    that are no strings and leaves that are neither.
    """
    tensors: dict[str, Tensor] = {}
    values: State = {}
    for key, leaf in state.items():
        if not isinstance(key, str):
            raise CheckpointError(f"key {prefix}{key!r}: a checkpoint's keys are strings")
        path = prefix + key.replace("~", "~0").replace("/", "~1")
        if isinstance(leaf, Tensor):
            tensors[path] = leaf.detach().cpu()
        elif isinstance(leaf, Mapping) and leaf:
            inner_tensors, inner_values = flatten(leaf, f"{path}/")
            tensors |= inner_tensors
            values |= inner_values
        elif leaf is None or isinstance(leaf, bool | int | float | str | list | tuple | Mapping):
            values[path] = dict(leaf) if isinstance(leaf, Mapping) else leaf
        else:
            raise CheckpointError(f"{path}: a {type(leaf).__name__} cannot be kept in a checkpoint")
    return tensors, values


def unflatten(tensors: Mapping[str, Tensor], values: Mapping[str, Any]) -> State:
    """Nested dict from tensors and values by path: the inverse of `flatten`."""
    state: State = {}
    for path, leaf in (*tensors.items(), *values.items()):
        *parents, key = (k.replace("~1", "/").replace("~0", "~") for k in path.split("/"))
        at = state
        for parent in parents:
            at = at.setdefault(parent, {})
        at[key] = leaf
    return state


def write(path: Path, state: Mapping[str, State], manifest: Manifest) -> Path:
    """Write sections of state as a checkpoint directory, atomically; returns its path.

    Raises CheckpointError where the disk is full or not writable, and removes the partial files.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing_folder(path) as partial:
            files, values = {}, {}
            for section, content in state.items():
                tensors, values[section] = flatten(content)
                file = partial / f"{section}.safetensors"
                save_file(_unshared(tensors), file)
                files[file.name] = {"sha256": _digest(file), "bytes": file.stat().st_size}
                _sync(file)
            table = {"format": FORMAT, **asdict(manifest), "files": files, "values": values}
            text = json.dumps(table | {"sha256": digest_of(table)}, indent=1)
            (partial / MANIFEST).write_text(text)
            _sync(partial / MANIFEST)
            _sync(partial)
        _sync(path.parent)
    except (OSError, SafetensorError) as error:
        raise CheckpointError(
            f"cannot write checkpoint {path}: {error}; free some space or choose another --run"
        ) from error
    return path


def read(
    path: Path, sections: Sequence[str] = SECTIONS, layout: Layout | None = None
) -> Checkpoint:
    """Load and verify sections of a checkpoint.

    Raises CheckpointError, naming the file, where one is missing, truncated or changed, and
    LayoutError where features, goal, actions or hidden widths differ from `layout`.
    """
    with refusing(CheckpointError, path, "checkpoint"):
        return _read(path, sections, layout)


def _read(path: Path, sections: Sequence[str], layout: Layout | None) -> Checkpoint:
    raw = _read_manifest(path)
    manifest = _manifest(raw, path)
    if layout is not None:
        layout.require(manifest.layout, str(path))
    state: State = {}
    for section in sections:
        file = path / f"{section}.safetensors"
        if file.name not in raw["files"]:
            held = ", ".join(sorted(raw["files"]))
            raise CheckpointError(f"{path} has no {file.name}; it holds {held}")
        try:
            if _digest(file) != raw["files"][file.name]["sha256"]:
                if what := pointer(file):
                    raise CheckpointError(f"{file}: {what}")
                raise CheckpointError(
                    f"{file} is damaged: not the bytes that were written; use an older checkpoint"
                )
            tensors = load_file(file)
        except (OSError, SafetensorError) as error:
            raise CheckpointError(f"cannot read {file}: {error}") from error
        state[section] = unflatten(tensors, raw["values"].get(section, {}))
    return Checkpoint(path, manifest, state)


def read_manifest(path: Path) -> Manifest:
    """Manifest of a checkpoint; opens no other file."""
    with refusing(CheckpointError, path, "checkpoint"):
        return _manifest(_read_manifest(path), path)


def _read_manifest(path: Path) -> dict[str, Any]:
    file = path / MANIFEST
    try:
        if file.stat().st_size > MAX_MANIFEST_BYTES:
            raise CheckpointError(
                f"{file} has {file.stat().st_size} bytes; at most {MAX_MANIFEST_BYTES} are read"
            )
        raw = json.loads(read_bounded(file, MAX_MANIFEST_BYTES))
    except FileNotFoundError as error:
        raise CheckpointError(f"{path} is no checkpoint: it has no {MANIFEST}") from error
    except (OSError, ValueError) as error:
        raise CheckpointError(f"{file} is damaged: {error}; use an older checkpoint") from error
    if not isinstance(raw, dict) or raw.get("format") not in READABLE:
        found = raw.get("format") if isinstance(raw, dict) else None
        known = " and ".join(map(str, READABLE))
        raise LayoutError(f"{file}: format {found}, this version reads formats {known}")
    if raw["format"] != 1 and raw.pop("sha256", None) != digest_of(raw):
        raise CheckpointError(
            f"{file} is damaged: not the text that was written; use an older checkpoint"
        )
    return raw


def _manifest(raw: Mapping[str, Any], path: Path) -> Manifest:
    try:
        table = raw["layout"]
        layout = Layout(
            task=str(table["task"]),
            features=tuple((str(name), int(width)) for name, width in table["features"]),
            goal=tuple((str(name), int(width)) for name, width in table["goal"]),
            actions=int(table["actions"]),
            hidden=tuple(int(width) for width in table["hidden"]),
            skip=bool(table.get("skip", False)),
        )
        _bounded(layout)
        if not isinstance(raw["files"], dict) or not isinstance(raw["values"], dict):
            raise ValueError("files and values")
        return Manifest(layout, int(raw["iteration"]), int(raw["samples"]), dict(raw["notes"]))
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise CheckpointError(
            f"{path / MANIFEST} is damaged: {error!r} missing or wrong"
        ) from error


def _bounded(layout: Layout) -> None:
    """Raise ValueError for a network beyond the bounds of this module.

    Otherwise a manifest of a few bytes could allocate gigabytes.
    """
    widths = (*layout.hidden, layout.actions, layout.observation)
    fields = (*layout.features, *layout.goal)
    if not all(1 <= width <= MAX_WIDTH for width in widths) or any(w < 0 for _, w in fields):
        raise ValueError(f"a layer's width beyond 1 to {MAX_WIDTH}")
    sides = (layout.observation, *layout.hidden, layout.actions)
    if sum(a * b for a, b in pairwise(sides)) > MAX_WEIGHTS:
        raise ValueError(f"more than {MAX_WEIGHTS} weights")
    if not 1 <= len(layout.hidden) <= MAX_LAYERS or len(fields) > MAX_FIELDS:
        raise ValueError(f"more than {MAX_LAYERS} layers or {MAX_FIELDS} fields")


def _unshared(tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Contiguous tensors, each with its own storage, as safetensors needs them."""
    seen: set[int] = set()
    own = {}
    for key, tensor in tensors.items():
        storage = tensor.untyped_storage()
        whole = (
            tensor.is_contiguous() and storage.nbytes() == tensor.numel() * tensor.element_size()
        )
        fresh = whole and storage.data_ptr() not in seen
        own[key] = tensor if fresh else tensor.clone(memory_format=torch.contiguous_format)
        seen.add(own[key].untyped_storage().data_ptr())
    return own


def digest_of(table: Mapping[str, Any]) -> str:
    """SHA-256 of JSON values, independent of white space and of the order of keys."""
    # Through JSON and back, so that tuples become lists as in a file that is read.
    text = json.dumps(json.loads(json.dumps(table)), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _digest(file: Path) -> str:
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _show(value: object) -> str:
    if isinstance(value, tuple) and value and isinstance(value[0], tuple):
        return ", ".join(f"{name} {width}" for name, width in value)
    return str(value)
