"""Calls of the client against a running service: the same numbers as by the bare stubs."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import inhabit_client
from inhabit_client import Client, ServiceError, connect, furniture, pose, situation
from inhabit_client.connection import is_local
from rpc.server import ServerConfig
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import Running, chair, fixed, make, observation, running, stub
from tests.support.policy_cases import pose as standing
from world.character import model as character


@pytest.fixture(scope="module")
def server() -> Iterator[Running]:
    with running([fixed(make())]) as found:
        yield found


@pytest.fixture(scope="module")
def client(server: Running) -> Iterator[Client]:
    with connect(server.server.address) as found:
        yield found


def test_policies_and_joints(client: Client) -> None:
    (policy,) = client.policies()
    assert (policy.name, policy.task, policy.licence) == ("sit", "sit", "Apache-2.0")
    assert [joint.name for joint in client.joints()] == [j.name for j in character.JOINTS]
    assert client.describe("sit").control_hz == 30


def test_actions_are_those_of_the_stubs(client: Client, server: Running) -> None:
    state, goal = observation(1, 5)
    rows = [np.frombuffer(part, "<f4").reshape(5, -1) for part in (state, goal)]
    found = client.act("sit", *rows)
    assert found.action.shape == found.target.shape == (5, 28)
    with stub(server) as bare:
        wanted = bare.Act(pb.ActRequest(task="sit", state=state, goal=goal))
    assert found.action.tobytes() == wanted.action and found.version == wanted.version
    sampled = [client.act("sit", *rows, seed=seed).action for seed in (3, 3, 4)]
    np.testing.assert_array_equal(sampled[0], sampled[1])
    assert np.abs(sampled[0] - sampled[2]).max() > 0.01


def test_actions_of_poses(client: Client, server: Running) -> None:
    qpos = character.standing_qpos()
    here = pose((0, 0, qpos[2]), (1, 0, 0, 0), qpos[7:])
    there = furniture("chair-test-000", (2.0, 0.5, 0.3))
    found = client.act_from_poses("sit", [situation(here, there)] * 2)
    with stub(server) as bare:
        wanted = bare.ActFromPose(
            pb.ActFromPoseRequest(
                task="sit",
                situations=[pb.Situation(pose=standing(), furniture=chair(2.0, 0.5, 0.3))],
            )
        )
    np.testing.assert_allclose(found.action[1], np.frombuffer(wanted.action, "<f4"), atol=1e-5)


def test_a_motion_is_that_of_the_stubs(client: Client, server: Running) -> None:
    found = client.synthesize("sit", furniture("chair-test-000", (1, 2, 0.5)), (3, 0, 1.5), 0.3)
    request = pb.SynthesizeRequest(task="sit", seconds=0.3, bodies=True)
    request.furniture.CopyFrom(chair(1, 2, 0.5))
    request.start.standing.CopyFrom(pb.Stance(x=3, y=0, yaw_rad=1.5))
    with stub(server) as bare:
        frames = [part.frame for part in bare.Synthesize(request) if part.HasField("frame")]
    position, rotation = found.bodies()
    theirs = np.array([f.body_position for f in frames]).reshape(position.shape)
    np.testing.assert_allclose(position, theirs, atol=1e-5)
    turned = np.array([f.body_rotation for f in frames]).reshape(rotation.shape)
    np.testing.assert_allclose(np.abs(np.sum(rotation * turned, axis=-1)), 1.0, atol=1e-5)
    np.testing.assert_allclose(found.object_position, np.tile((1, 2, 0), (10, 1)), atol=1e-6)
    assert found.fps == 30 and len(found.frames) == 10 and not found.success
    np.testing.assert_allclose(found.times_s, np.arange(10) / 30, atol=1e-9)


def test_frames_come_one_by_one_and_may_be_left(client: Client, server: Running) -> None:
    request = pb.SynthesizeRequest(task="sit", seconds=20.0, to_the_end=True)
    request.furniture.CopyFrom(chair())
    request.start.standing.CopyFrom(pb.Stance())
    own = inhabit_client.messages.SynthesizeRequest.FromString(request.SerializeToString())
    frames = client.frames(own)
    first = next(frames)
    assert first.time_s == 0 and first.local_rotation.shape == (15, 4)
    frames.close()
    # the place is free again: all that the service can simulate at once
    many = client.describe().limits.max_syntheses
    for _ in range(many):
        client.synthesize("sit", furniture("chair-test-000"), seconds=0.1)


def test_refusals_are_one_line(client: Client) -> None:
    with pytest.raises(ServiceError) as caught:
        client.act("walk", np.zeros((1, 114)), np.zeros((1, 4)))
    assert caught.value.code == "NOT_FOUND" and "sit" in caught.value.text
    with pytest.raises(ServiceError, match="INVALID_ARGUMENT"):
        client.synthesize("sit", furniture("no-such-piece"), seconds=0.1)
    with pytest.raises(ValueError, match="must be"):
        client.act("sit", np.zeros(114), np.zeros((1, 29)))
    with connect("127.0.0.1:9") as nobody, pytest.raises(ServiceError) as away:
        nobody.policies()
    assert away.value.code == "UNAVAILABLE" and "\n" not in str(away.value)


def test_a_token_is_sent(tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("secret\n")
    token.chmod(0o600)
    with running([fixed(make())], server_config=ServerConfig(token_file=str(token))) as server:
        address = server.server.address
        with connect(address, token="secret") as client:
            assert client.policies()[0].name == "sit"
            assert len(client.synthesize("sit", furniture("chair-test-000"), seconds=0.1).frames)
        with connect(address, token="other") as client, pytest.raises(ServiceError) as caught:
            client.policies()
        assert caught.value.code == "UNAUTHENTICATED"


def test_a_token_does_not_go_out_bare() -> None:
    with pytest.raises(ValueError, match="by TLS alone"):
        connect("example.org:443", token="secret")
    connect("example.org:443", token="secret", tls=True).close()


@pytest.mark.parametrize(
    ("address", "local"),
    [
        ("127.0.0.1:1", True), ("[::1]:1", True), ("localhost:1", True), ("unix:/tmp/x", True),
        ("10.0.0.1:1", False), ("example.org:1", False), ("[2001:db8::1]:1", False),
    ],
)  # fmt: skip
def test_what_is_on_this_machine(address: str, local: bool) -> None:
    assert is_local(address) == local
