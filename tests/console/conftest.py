"""What the tests of console share."""

from pathlib import Path

import pytest

from console.app import main
from tests.support.console.runs import SMALL


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of four iterations."""
    folder = tmp_path_factory.mktemp("runs") / "whole"
    assert main(["train", "sit", "--run", str(folder), "--iterations", "4", *SMALL]) == 0
    return folder
