"""Reader of `.npz` clips on the paper's 15-body character (the layout of the SAMP conversion).

Keys: `fps`; `root_position_m` [T, 3], z up; `local_rotation_wxyz` [T, 15, 4]; `body_names` [15].
Rest pose with hanging arms, as ours, so that local rotations carry over.
"""

from pathlib import Path
from typing import Any

import numpy as np

from world.character import model as character
from world.errors import ClipError
from world.motions import clip_file
from world.motions.clip import Clip
from world.motions.formats import arrays
from world.refusals import refusing

SUFFIX = ".npz"
_KEYS = ("fps", "root_position_m", "local_rotation_wxyz", "body_names")


def read(path: Path) -> Clip:
    """The clip in the file at its own frame rate; ClipError in one line if it is none of this
    format."""
    with refusing(ClipError, path, ".npz clip"), arrays.opened(path) as file:
        missing = [key for key in _KEYS if key not in file]
        if missing:
            raise ClipError(f"{path}: no {', '.join(missing)}; a clip has {', '.join(_KEYS)}")
        fps, position, rotation, names = (file[key] for key in _KEYS)
        extras = clip_file.extras(file, str(path))
        return _clip(path, fps, position, rotation, names, extras)


def _clip(
    path: Path,
    fps: np.ndarray,
    position: np.ndarray,
    rotation: np.ndarray,
    names: np.ndarray,
    extras: dict[str, Any],
) -> Clip:
    order = _order(path, [str(name) for name in names])
    rate = float(fps)
    if not 1 <= rate <= 1000:
        raise ClipError(f"{path}: fps is {rate}; expected 1 to 1000")
    if rotation.ndim != 3 or rotation.shape[1] != len(names):
        raise ClipError(
            f"{path}: local_rotation_wxyz is {rotation.shape}, not [T, {len(names)}, 4]"
        )
    about: dict[str, Any] = {"source": str(path.name), "licence": _licence(path.parent)}
    about |= extras | {"name": path.stem}
    return Clip(
        fps=round(rate),
        root_position_m=position.astype(np.float32),
        local_rotation=rotation[:, order].astype(np.float32),
        **about,
    )


def _order(path: Path, names: list[str]) -> list[int]:
    missing = [body for body in character.BODIES if body not in names]
    if missing:
        raise ClipError(
            f"{path}: does not fit the character: no {', '.join(missing)} among its bodies "
            f"({', '.join(names)})"
        )
    return [names.index(body) for body in character.BODIES]


def _licence(folder: Path) -> str:
    """The licence line of the folder's README, or a word that there is none."""
    readme = folder / "README.md"
    if readme.is_file():
        for line in readme.read_text(errors="replace").splitlines():
            if "licence" in line.lower():
                return line.strip(" -*")[:200]
    return "not stated"
