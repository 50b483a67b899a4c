"""Control of a character by the client: one reply a step, frames that are missed are counted."""

import numpy as np
import pytest

from inhabit_client import ServiceError, connect, furniture, pose, situation
from tests.support.policy_cases import fixed, make, running
from world.character import model as character

QPOS = character.standing_qpos()
HERE = pose((0, 0, QPOS[2]), (1, 0, 0, 0), QPOS[7:])
CHAIR = furniture("chair-test-000", (2.0, 0.0, 0.0))


def test_each_step_has_the_action_of_its_situation() -> None:
    with running([fixed(make())]) as server, connect(server.server.address) as client:
        wanted = client.act_from_poses("sit", [situation(HERE, CHAIR)])
        with client.control("sit") as session:
            for _ in range(3):
                found = session.step(situation(HERE, CHAIR))
                np.testing.assert_allclose(found.action, wanted.action, atol=1e-5)
            assert session.dropped == 0 and found.target.shape == (1, 28)
            session.step(situation(HERE, CHAIR), sequence=7)
            assert session.dropped == 4
            with pytest.raises(ServiceError, match="sequence"):
                session.step(situation(HERE, CHAIR), sequence=2)
