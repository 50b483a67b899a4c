"""Clips as `.npz` files: the motion under the keys of the SAMP conversion, and beside it what it
uses.

Keys: `fps`; `root_position_m` [T, 3]; `local_rotation_wxyz` [T, 15, 4]; `body_names` [15]; `about`,
JSON: source, licence, seat, bed, the box's size, the ghost's joints; `box_pose` [T, 7], `box_held`
[T] and `ghost_m` [T, J, 3] where there are any.
"""

import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from world.character import model as character
from world.errors import ClipError
from world.motions.clip import Clip
from world.motions.objects import Bed, BoxTrack, Seat, Skeleton


def write(path: Path, clip: Clip) -> None:
    """One clip as one file; it appears whole or not at all."""
    write_arrays(path, arrays(clip))


def write_arrays(path: Path, content: Mapping[str, np.ndarray]) -> None:
    """Arrays as one `.npz` file, written beside it first and then renamed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, partial = tempfile.mkstemp(dir=path.parent, suffix=".partial")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, allow_pickle=False, **content)
        Path(partial).replace(path)
    except BaseException:
        Path(partial).unlink(missing_ok=True)
        raise


def arrays(clip: Clip) -> dict[str, np.ndarray]:
    """What a file holds of a clip, by key."""
    about = {
        "name": clip.name,
        "source": clip.source,
        "licence": clip.licence,
        "seat": asdict(clip.seat) if clip.seat else None,
        "bed": asdict(clip.bed) if clip.bed else None,
        "box_size_m": clip.box.size_m if clip.box else None,
        "ghost": (
            {"names": clip.ghost.names, "parents": clip.ghost.parents} if clip.ghost else None
        ),
    }
    content = {
        "fps": np.array(clip.fps),
        "root_position_m": clip.root_position_m,
        "local_rotation_wxyz": clip.local_rotation,
        "body_names": np.array(character.BODIES),
        "about": np.array(json.dumps(about)),
    }
    if clip.box:
        content |= {"box_pose": clip.box.pose, "box_held": clip.box.held}
    if clip.ghost:
        content["ghost_m"] = clip.ghost.position_m
    return content


def extras(content: Mapping[str, np.ndarray], name: str) -> dict[str, Any]:
    """The fields of a Clip besides the motion, of a file's arrays; none where it has no `about`.

    ClipError, which starts with `name`, where they are there but are not what `arrays` writes.
    """
    if "about" not in content:
        return {}
    try:
        about = json.loads(str(content["about"]))
        return {
            "name": str(about["name"]),
            "source": str(about["source"]),
            "licence": str(about["licence"]),
            "seat": _lasting(Seat, about["seat"]),
            "bed": _lasting(Bed, about["bed"]),
            "box": _box(about["box_size_m"], content),
            "ghost": _ghost(about["ghost"], content),
        }
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ClipError(f"{name}: its 'about' is not that of a clip ({error})") from error


def _lasting(kind: type[Seat] | type[Bed], fields: dict[str, Any] | None) -> Any:
    """A seat or a bed of its JSON, lists made tuples again."""
    if fields is None:
        return None
    values: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in fields.items()
    }
    return kind(**values)


def _box(size_m: list[float] | None, content: Mapping[str, np.ndarray]) -> BoxTrack | None:
    if size_m is None:
        return None
    x, y, z = size_m
    pose = content["box_pose"].astype(np.float32)
    return BoxTrack(pose, (float(x), float(y), float(z)), content["box_held"].astype(bool))


def _ghost(about: dict[str, Any] | None, content: Mapping[str, np.ndarray]) -> Skeleton | None:
    if about is None:
        return None
    return Skeleton(
        tuple(map(str, about["names"])),
        tuple(map(int, about["parents"])),
        content["ghost_m"].astype(np.float32),
    )
