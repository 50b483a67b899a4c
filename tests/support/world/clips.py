"""Clips as files, and poses compared."""

from pathlib import Path

import numpy as np

from world.character import model as character
from world.motions.clip import Clip


def saved(path: Path, clip: Clip, **changes: np.ndarray) -> Path:
    fields = {
        "fps": np.array(clip.fps),
        "root_position_m": clip.root_position_m,
        "local_rotation_wxyz": clip.local_rotation,
        "body_names": np.array(character.BODIES),
    }
    np.savez(path, **(fields | changes))
    return path
