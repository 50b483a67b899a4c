"""What the tests of console/bench share."""

import pytest

from actors.local import LocalFleet
from policy.rollout import Rollout
from tests.support.console.stand_ins import weights
from tests.support.faulty_shard import MakePoints

SCENES, HORIZON, NODES, ACTORS_A_NODE = 8, 4, 2, 2


@pytest.fixture(scope="session")
def part() -> Rollout:
    fleet = LocalFleet(MakePoints(), SCENES, SCENES, 1, seed=5, horizon=HORIZON)
    rollout = fleet.collect(weights(0), 0, 0.1)
    fleet.close()
    return rollout
