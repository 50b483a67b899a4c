"""Walk in the player, in recordings and in the flags of synthesize."""

import math
from pathlib import Path

import numpy as np
import pytest

from console.commands import Synthesize
from console.kinds.setup import Pose
from console.play.recorded import measured
from console.play.stock import Stock
from console.synthesis.motion import simulate
from console.synthesis.request import scene
from tests.support import policy_cases
from world import tasks
from world.errors import ConfigError

WALK = tasks.make("walk")


def test_the_player_goes_to_a_point_that_moves() -> None:
    stock = Stock({"walk": policy_cases.make(name="walk", task="walk")})
    live = stock.begin(stock.first())
    goal = stock.first().goal
    distance = math.hypot(goal.x, goal.y)
    assert live.moments[0].error_m == pytest.approx(max(distance, 0.2 * 9), abs=1e-3)
    live.scene.move(Pose(0.0, 1.0, 0.0))
    assert live.extend() and live.extend()
    assert live.moments[-1].goal != goal
    take = live.take()
    # the marker is where the goal is, and a recording's errors are those of the player
    assert take.mocap_pos[-1, :2] == pytest.approx([live.moments[-1].goal.x,
                                                    live.moments[-1].goal.y], abs=1e-5)  # fmt: skip
    errors = measured(take, "walk").error_m
    assert errors is not None
    assert errors == pytest.approx([m.error_m for m in live.moments], abs=1e-3)


def test_flags_give_a_motion_and_a_clip() -> None:
    command = Synthesize(Path("run"), (Path("out.npz"),), at="1,2,90", start="0,0,0", seconds=0.2)
    request, piece = scene(command, WALK, None)
    assert piece is None and list(request.furniture.position) == [1.0, 2.0, 0.0]
    motion = simulate(request, policy_cases.make(task="walk"))
    assert motion.piece == "floor" and motion.frames[0].error_m == pytest.approx(math.hypot(1, 2))
    clip = motion.clip()
    assert clip.seat is None and clip.bed is None and clip.box is None
    assert np.isfinite(clip.root_position_m).all()
    with pytest.raises(ConfigError, match="leave it out"):
        scene(Synthesize(Path("run"), (Path("o.npz"),), object="chair-test-000"), WALK, None)
