"""What the tests of console/synthesis share."""

from pathlib import Path

import pytest

from console.app import main
from console.synthesis import files as motion_files
from tests.support.console.syntheses import asked


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """What the committed policy does from right before a chair, in every kind of file but films."""
    folder = tmp_path_factory.mktemp("motion") / "new"
    kinds = [suffix for suffix in motion_files.SUFFIXES if suffix != ".mp4"]
    found = {suffix: folder / f"sits{suffix}" for suffix in kinds}
    words = ["--start", "0.6,0,0", "--seconds", "6", "--tries", "5", "--out"]
    assert main(asked(*words, *map(str, found.values()))) == 0
    return found
