"""What makes no scene is one line."""

import math
import re

import pytest

from console.kinds.setup import Pose, Setup
from console.play.session import Session
from tests.support.console.players import live, stock
from world.errors import InhabitError


def test_what_makes_no_scene_is_one_line() -> None:
    chair = next(iter(stock().pieces("sit")))
    for setup, said in (
        (Setup("fly", chair), "unknown policy 'fly': choose one of carry, lie, sit"),
        (Setup("sit", "throne"), "unknown piece 'throne': choose one of"),
        (Setup("sit", chair, scale=9.0), "scale 9: choose 0.5 to 1.5"),
        (Setup("sit", chair, goal=Pose(math.nan, 0)), "goal: must be finite numbers"),
        (Setup("sit", chair, start=Pose(0, 50)), "start: choose x and y within 20 m"),
    ):
        with pytest.raises(InhabitError, match=re.escape(said)) as error:
            Session(live(), stock()).begin(setup)
        assert "\n" not in str(error.value)
