"""A few seconds of motion as clip files: what a shard needs, made in a second."""

from pathlib import Path

import numpy as np

from world.character import model as character
from world.motions.clip import Clip
from world.motions.synthetic import library


def write(folder: Path) -> Path:
    """One clip that sits down and one that walks, as `.npz` files in `folder`; returns it."""
    folder.mkdir(parents=True, exist_ok=True)
    generator = np.random.default_rng(0)
    for clip in (
        library.sitting(generator, 0.44, 1.5, 0.3, 1, back=True),
        library.walking(generator, 1.0),
    ):
        _save(folder / f"{clip.name}.npz", clip)
    return folder


def _save(path: Path, clip: Clip) -> None:
    np.savez(
        path,
        fps=clip.fps,
        root_position_m=clip.root_position_m,
        local_rotation_wxyz=clip.local_rotation,
        body_names=np.array(character.BODIES),
    )
