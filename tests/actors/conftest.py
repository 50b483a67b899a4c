"""What the tests of actors share."""

import pytest

from policy.rollout import Rollout
from tests.support.learning.fleets import local, run


@pytest.fixture(scope="session")
def undisturbed() -> list[Rollout]:
    fleet = local()
    rollouts = run(fleet)
    fleet.close()
    assert sum(len(r.end_index) for r in rollouts) > 50, "resets must be part of the comparison"
    return rollouts
