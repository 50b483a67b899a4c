"""Clips of the character itself (`.npz`), read as recordings so that they can be mended."""

from pathlib import Path

from world.motions import samp
from world.motions.clip import validate
from world.motions.formats import own
from world.motions.formats.recording import Recording

SUFFIXES = (samp.SUFFIX,)
KEYS = ("fps", "root_position_m", "local_rotation_wxyz", "body_names")


def read(path: Path) -> Recording:
    """The clip in the file as a recording on the character's own body."""
    clip = validate(samp.read(path))
    return own.recording(path, clip.fps, clip.root_position_m.astype(float),
                         clip.local_rotation.astype(float))  # fmt: skip
