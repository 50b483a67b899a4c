"""What the tests of console/motions share."""

from pathlib import Path

import pytest

from tests.support import small_clips


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_clips.write(tmp_path_factory.mktemp("clips"))
