"""The research clips that some tests need; they are not part of the package."""

from functools import cache
from pathlib import Path

import pytest

from world.motions import load
from world.motions.clip import Clip

FOLDER = Path(__file__).parents[2] / "shared" / "motions" / "samp"

needs_samp = pytest.mark.skipif(
    not FOLDER.is_dir(), reason="the SAMP clips (research only) are not at ../shared/motions/samp"
)


@cache
def prepared(name: str) -> Clip:
    """One prepared clip of the folder, its first part."""
    return load.clips((str(FOLDER / f"{name}.npz"),))[0]
