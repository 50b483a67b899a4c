"""The project's own clip format, `.npz`: its reader and its writer.

Keys: `fps`; `root_position_m` [T, 3], z up; `local_rotation_wxyz` [T, 15, 4]; `body_names` [15].
These are the keys of the SAMP conversion, whose character has our bodies and rest pose. Optional
keys: `about`, JSON: source, licence, seat, bed, the box's size, the ghost's joints; `box_pose`
[T, 7], `box_held` [T] and `ghost_m` [T, J, 3].
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from world.character import model as character
from world.errors import ClipError
from world.motions import npz
from world.motions.clip import Clip, validate
from world.motions.licences import dataset, licence, named
from world.motions.objects import Bed, BoxTrack, Seat, Skeleton
from world.partial_files import replacing
from world.refusals import reason, refusing

SUFFIX = ".npz"
SMPL_SUFFIX = ".smpl.npz"
"""Suffix of SMPL parameters, which end like clips and are none."""
KEYS = ("fps", "root_position_m", "local_rotation_wxyz", "body_names")
"""Keys that a clip must have."""


def read(path: Path) -> Clip:
    """Return the clip in a file, at its own frame rate.

    Raises ClipError in one line where it is not of this format or does not fit the character.
    """
    if path.suffix.lower() != SUFFIX:
        raise ClipError(
            f"{path}: unknown clip format '{path.suffix}', must be {SUFFIX}"
            " ('inhabit motions import' makes clips of others)"
        )
    if is_smpl(path):
        raise ClipError(
            f"{path}: SMPL parameters, not a clip ('inhabit motions import' makes a clip of them)"
        )
    about = {"source": named(path.name, dataset(path)), "licence": licence(path)}
    with refusing(ClipError, path, ".npz clip"), npz.opened(path) as file:
        return validate(clip_of(file, str(path), about, {"name": path.stem}))


def is_smpl(path: Path) -> bool:
    """Return whether a file holds SMPL parameters, by its name and keys; a damaged one does not."""
    if not path.name.lower().endswith(SMPL_SUFFIX):
        return False
    try:
        with npz.opened(path) as file:
            return not set(KEYS) & set(file)
    except Exception:  # a damaged file raises any exception: its reader says so
        return False


def write(path: Path, clip: Clip) -> None:
    """Write one clip as one file, atomically."""
    write_arrays(path, arrays(clip))


def write_arrays(path: Path, content: Mapping[str, np.ndarray]) -> None:
    """Write arrays as one `.npz` file, atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as partial, partial.open("wb") as file:
        np.savez(file, allow_pickle=False, **content)


def arrays(clip: Clip) -> dict[str, np.ndarray]:
    """Return the arrays of a clip's file by key."""
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


def clip_of(
    content: Mapping[str, np.ndarray],
    where: str,
    absent: Mapping[str, Any] | None = None,
    fixed: Mapping[str, Any] | None = None,
) -> Clip:
    """Return the clip of a file's arrays, not validated; messages of ClipError begin with `where`.

    absent: fields of a clip without `about`; fixed: fields that override `about`.
    """
    missing = [key for key in KEYS if key not in content]
    if missing:
        raise ClipError(f"{where}: no {', '.join(missing)}; a clip has {', '.join(KEYS)}")
    fps, position, rotation, names = (content[key] for key in KEYS)
    rate = npz.scalar(fps)
    if not 1 <= rate <= 1000:
        raise ClipError(f"{where}: fps is {rate}; expected 1 to 1000")
    if rotation.ndim != 3 or rotation.shape[1] != len(names):
        raise ClipError(
            f"{where}: local_rotation_wxyz is {rotation.shape}, not [T, {len(names)}, 4]"
        )
    order = _order(where, [str(name) for name in names])
    return Clip(
        fps=round(rate),
        root_position_m=position.astype(np.float32),
        local_rotation=rotation[:, order].astype(np.float32),
        **{**(absent or {}), **_extras(content, where), **(fixed or {})},
    )


def _order(where: str, names: list[str]) -> list[int]:
    missing = [body for body in character.BODIES if body not in names]
    if missing:
        raise ClipError(
            f"{where}: does not fit the character: no {', '.join(missing)} among its bodies "
            f"({', '.join(names)})"
        )
    return [names.index(body) for body in character.BODIES]


def _extras(content: Mapping[str, np.ndarray], name: str) -> dict[str, Any]:
    """Return the fields of a Clip besides the motion; empty without `about`.

    Raises ClipError, which begins with `name`, where they do not have the form of `arrays`.
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
        raise ClipError(f"{name}: its 'about' is not that of a clip ({reason(error)})") from error


def _lasting(kind: type[Seat] | type[Bed], fields: dict[str, Any] | None) -> Any:
    """A seat or bed of its JSON, with tuples for lists."""
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
