"""Clips that were made once, kept on disk: the package's own take seconds to make.

The key is the digest of the code that makes them, so that a change of it makes them again.
"""

import contextlib
import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict
from importlib import resources
from pathlib import Path

import numpy as np

from world.motions.clip import Clip, Seat


def folder() -> Path:
    """Where cached clips are: $XDG_CACHE_HOME/inhabit, or .cache/inhabit in the user's home."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "inhabit"


def code_digest(package: str) -> str:
    """A digest of a package's Python files."""
    digest = hashlib.sha256()
    for file in sorted(resources.files(package).iterdir(), key=lambda f: f.name):
        if file.name.endswith(".py"):
            digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def cached(key: str, make: Callable[[], Sequence[Clip]]) -> tuple[Clip, ...]:
    """The clips under `key`, made where they are not there, damaged or not writable."""
    path = folder() / f"clips-{key}.npz"
    try:
        return read(path)
    except (OSError, ValueError, KeyError, TypeError, EOFError):
        clips = tuple(make())
    # a read-only home costs the time again, nothing else
    with contextlib.suppress(OSError):
        write(path, clips)
    return clips


def write(path: Path, clips: Sequence[Clip]) -> None:
    """One file for all clips; it appears whole or not at all."""
    arrays: dict[str, np.ndarray] = {}
    notes = []
    for index, clip in enumerate(clips):
        arrays[f"position{index}"] = clip.root_position_m
        arrays[f"rotation{index}"] = clip.local_rotation
        seat = asdict(clip.seat) if clip.seat else None
        about = {"name": clip.name, "fps": clip.fps, "source": clip.source, "seat": seat}
        notes.append(about | {"licence": clip.licence})
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, partial = tempfile.mkstemp(dir=path.parent, suffix=".partial")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, allow_pickle=False, notes=np.array(json.dumps(notes)), **arrays)
        Path(partial).replace(path)
    except BaseException:
        Path(partial).unlink(missing_ok=True)
        raise


def read(path: Path) -> tuple[Clip, ...]:
    """What `write` wrote; OSError, ValueError or KeyError where it is missing or damaged."""
    with np.load(path, allow_pickle=False) as file:
        return tuple(
            Clip(
                name=note["name"],
                fps=int(note["fps"]),
                root_position_m=file[f"position{index}"],
                local_rotation=file[f"rotation{index}"],
                source=note["source"],
                licence=note["licence"],
                seat=_seat(note["seat"]),
            )
            for index, note in enumerate(json.loads(str(file["notes"])))
        )


def _seat(fields: dict[str, object] | None) -> Seat | None:
    if fields is None:
        return None
    seat = Seat(**fields)  # pyright: ignore[reportArgumentType]
    x, y, z = seat.point_m
    return Seat((x, y, z), seat.facing_rad, seat.from_frame, seat.to_frame)
