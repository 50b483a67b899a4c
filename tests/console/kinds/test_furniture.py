"""Furniture in the player."""

import math
from pathlib import Path

import numpy as np
import pytest

from console.commands import Synthesize
from console.kinds.setup import Pose, Setup
from console.synthesis.request import scene
from tests.support.console.players import stock
from world import tasks
from world.errors import ConfigError
from world.furniture.usage import use_points


def test_a_bed_has_a_side_of_its_own_choice() -> None:
    both = [n for n, p in stock().pieces("lie").items() if len(use_points(p, "lie")) == 2]
    beds = [n for n in both if n.startswith("bed")]  # single ones: a double bed has one side
    found = []
    for side in (0, 1):
        source = stock().begin(Setup("lie", beds[0], side=side, goal=Pose(3.0, 0.0, 0.5)))
        place = source.scene._object.target(source.scene._scenes)
        assert place.facing[0].tolist() == pytest.approx([math.cos(0.5), math.sin(0.5)])
        # the head is to the left of one side and to the right of the other
        assert place.head is not None
        along = (place.head - place.point)[0, :2].numpy()
        found.append(np.cross([*place.facing[0].numpy(), 0.0], [*along, 0.0])[2])
    assert found[0] * found[1] < 0
    with pytest.raises(ConfigError, match="has sides 0 to 1"):
        stock().begin(Setup("lie", beds[0], side=2))


def test_a_seat_must_be_named() -> None:
    command = Synthesize(Path("run"), (Path("out.npz"),))
    with pytest.raises(ConfigError, match="--object: name a piece"):
        scene(command, tasks.make("sit"), None)
