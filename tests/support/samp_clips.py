"""The research clips that some tests need; they are not part of the package."""

from functools import cache

import pytest

from tests.support.paths import SHARED
from world.motions import load
from world.motions.clip import Clip

FOLDER = SHARED / "motions" / "samp"

needs_samp = pytest.mark.skipif(
    not FOLDER.is_dir(), reason="the SAMP clips (research only) are not at ../shared/motions/samp"
)


@cache
def prepared(name: str) -> Clip:
    """One prepared clip of the folder, its first part."""
    return load.clips((str(FOLDER / f"{name}.npz"),))[0]
