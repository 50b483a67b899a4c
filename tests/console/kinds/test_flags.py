"""Numbers in flags: their form, and where they may lie."""

import pytest

from console.kinds.flags import numbers, within
from world.errors import ConfigError


def test_three_numbers() -> None:
    assert numbers("--at", "1, -2.5,90", "X,Y,YAW") == (1.0, -2.5, 90.0)
    for text in ("1,2", "1,2,3,4", "a,b,c", ""):
        with pytest.raises(ConfigError, match=f"^--at {text}: give X,Y,YAW$"):
            numbers("--at", text, "X,Y,YAW")
    for text in ("1,2,nan", "inf,0,0", "0,1001,0"):
        with pytest.raises(ConfigError, match=f"^--at {text}: each number must be within ±1000$"):
            numbers("--at", text, "X,Y,YAW")


def test_bounds() -> None:
    assert within("--scale", 5.0, (0.2, 5.0)) == 5.0
    for value in (0.1, 6.0, float("nan")):
        with pytest.raises(ConfigError, match=r"^--scale .*: choose 0\.2 to 5$"):
            within("--scale", value, (0.2, 5.0))
