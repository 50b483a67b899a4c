"""Ray is asked for its reach."""

import pytest

from tests.support.console.doctors import found


def test_a_cluster_that_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    code, lines = found(["--address", "127.0.0.1:1"], capsys)
    assert code == 1 and "no Ray answers at 127.0.0.1:1" in lines["ray"]["detail"]
