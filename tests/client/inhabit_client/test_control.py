"""Control of a character by the client: one reply a step, frames that are missed are counted."""

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import grpc
import numpy as np
import pytest

from inhabit_client import ServiceError, connect, furniture, pose, situation
from rpc.v1 import policy_pb2_grpc
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


def test_a_service_that_does_not_answer_ends_the_stream_at_the_deadline() -> None:
    """A stream had none: a control loop hung for ever."""

    class Silent(policy_pb2_grpc.PolicyServicer):
        def Control(self, request_iterator: Any, context: grpc.ServicerContext) -> Iterator[Any]:
            for _ in request_iterator:
                ended.wait(30)
                return
            yield

    ended = threading.Event()
    server = grpc.server(ThreadPoolExecutor(2))
    policy_pb2_grpc.add_PolicyServicer_to_server(Silent(), server)
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    try:
        with connect(f"127.0.0.1:{port}", deadline_s=0.5) as client:
            session = client.control("sit")
            with pytest.raises(ServiceError, match=r"^DEADLINE_EXCEEDED: no answer within 0\.5 s"):
                session.step(situation(HERE, CHAIR))
            with pytest.raises(ServiceError, match="CANCELLED"):
                session.step(situation(HERE, CHAIR))
    finally:
        ended.set()
        server.stop(0)
