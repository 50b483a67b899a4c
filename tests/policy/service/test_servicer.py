"""The policy service over loopback: the policy's own numbers, refusals, reloads, and the end."""

import gc
import threading
from collections.abc import Iterator

import grpc
import numpy as np
import pytest
import torch
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2, reflection_pb2_grpc

from policy.config import BatchConfig, PolicyServiceConfig
from policy.service.servicer import NAME
from rpc.v1 import policy_pb2 as pb
from rpc.v1 import policy_pb2_grpc
from tests.support.policy_cases import (
    SIT,
    WIDTH,
    Running,
    act,
    chair,
    expected,
    fixed,
    make,
    numbers,
    observation,
    pose,
    refusal,
    renamed,
    running,
    stub,
)
from world.character import features
from world.character import model as character
from world.character.features import STATE
from world.furniture.catalogue import find
from world.objects.furniture_bank import FurnitureBank
from world.scene.batch import Scenes
from world.scene.target import state as state_of

StatusCode = grpc.StatusCode
Stub = policy_pb2_grpc.PolicyStub


@pytest.fixture(scope="module")
def server() -> Iterator[Running]:
    served = make()
    with running([fixed(served), fixed(renamed(make(1), "other"))]) as found:
        yield found


@pytest.fixture
def client(server: Running) -> Iterator[Stub]:
    with stub(server) as found:
        yield found


def test_act_gives_the_policys_own_actions(client: Stub) -> None:
    for rows in (1, 3, 300, 1000):
        state, goal = observation(rows, rows)
        for name, seed in (("sit", 0), ("other", 1)):
            reply = client.Act(pb.ActRequest(task=name, state=state, goal=goal))
            np.testing.assert_allclose(
                numbers(reply.action), expected(seed, state, goal), rtol=2e-5, atol=2e-6
            )
            assert reply.version == make(seed).version


def test_targets_are_what_the_simulator_is_given(client: Stub) -> None:
    state, goal = observation(5, 50)
    reply = client.Act(pb.ActRequest(task="sit", state=state, goal=goal))
    scenes = Scenes(FurnitureBank([find("chair-test-000")]).models, 0.35, 3.0)
    wanted = scenes.set_points(torch.from_numpy(numbers(reply.action).copy())).numpy()
    np.testing.assert_allclose(numbers(reply.target), wanted, atol=1e-6)


def test_sampling_is_the_seeds(client: Stub) -> None:
    state, goal = observation(6, 400)

    def act(**more: int) -> np.ndarray:
        return numbers(client.Act(pb.ActRequest(task="sit", state=state, goal=goal, **more)).action)

    mean, one, again, two = act(), act(seed=3), act(seed=3), act(seed=4)
    assert (one == again).all() and (one != two).any()
    deviation = (one - mean).ravel()
    assert abs(deviation.std() / 0.1 - 1) < 0.03 and abs(deviation.mean()) < 0.005


def test_poses_give_what_the_simulators_features_give(client: Stub) -> None:
    draw = np.random.default_rng(0)
    for _ in range(5):
        yaw, place = float(draw.uniform(-3, 3)), draw.uniform(-3, 3, 2)
        here = pose(100.0, -50.0, float(draw.uniform(-3, 3)))
        here.root_velocity[:] = draw.uniform(-1, 1, 3).tolist()
        here.root_angular_velocity[:] = draw.uniform(-1, 1, 3).tolist()
        here.joint_velocity[:] = draw.uniform(-1, 1, 28).tolist()
        furniture = chair(100.0 + place[0], -50.0 + place[1], yaw)
        situation = pb.Situation(pose=here, furniture=furniture)
        reply = client.ActFromPose(pb.ActFromPoseRequest(task="sit", situations=[situation] * 3))
        state, goal = by_hand(here, furniture)
        raw = client.Act(pb.ActRequest(task="sit", state=state, goal=goal))
        np.testing.assert_allclose(
            numbers(reply.action), np.repeat(numbers(raw.action), 3, 0), atol=2e-4
        )


def by_hand(here: pb.Pose, furniture: pb.Furniture) -> tuple[bytes, bytes]:
    """State and goal of a pose by MuJoCo's conventions and the bank's own placing."""
    import mujoco

    rotation = np.array(here.root_rotation, dtype=np.float64)
    spin, back = np.zeros(3), np.zeros(4)
    mujoco.mju_negQuat(back, rotation)
    mujoco.mju_rotVecQuat(spin, np.array(here.root_angular_velocity, dtype=np.float64), back)
    qpos = np.concatenate((here.root_position, rotation, here.joint_position))
    qvel = np.concatenate((here.root_velocity, spin, here.joint_velocity))
    bank = FurnitureBank([find(furniture.piece)])
    w, _, _, z = furniture.rotation
    yaw = 2 * np.arctan2(z, w)
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    point = turn @ bank.point[0, :2].numpy() + np.array(furniture.position[:2])
    facing = turn @ bank.facing[0].numpy()
    place = bank.target(
        torch.tensor([0]),
        torch.from_numpy(point).float()[None],
        torch.from_numpy(facing).float()[None],
    )
    body = features.body(torch.from_numpy(qpos).float()[None], torch.from_numpy(qvel).float()[None])
    state, goal = state_of(body, place), SIT.goal_features(body, place)
    return state.numpy().tobytes(), goal.numpy().tobytes()


def test_a_shape_of_ones_own_is_as_good_as_the_catalogues(client: Stub) -> None:
    piece = find("chair-test-000")
    low, high = piece.bounds()
    custom = chair(1.5, 0.5, 1.0)
    custom.custom.CopyFrom(
        pb.Shape(
            low=low.tolist(),
            high=high.tolist(),
            hip=piece.sit[0].point_m,
            facing_rad=piece.sit[0].facing_rad,
        )
    )
    both = [
        pb.Situation(pose=pose(), furniture=furniture)
        for furniture in (chair(1.5, 0.5, 1.0), custom)
    ]
    reply = client.ActFromPose(pb.ActFromPoseRequest(task="sit", situations=both))
    first, second = numbers(reply.action)
    np.testing.assert_allclose(first, second, atol=1e-5)


def test_control_answers_each_frame_and_counts_the_missing(client: Stub) -> None:
    frames = [(0, 0), (1, 1), (4, 2), (9, 3)]

    def sent() -> Iterator[pb.ControlRequest]:
        for sequence, seed in frames:
            state, goal = observation(seed)
            yield pb.ControlRequest(
                task="sit" if sequence == 0 else "",
                sequence=sequence,
                observation=pb.Observation(state=state, goal=goal),
            )

    replies = list(client.Control(sent()))
    assert [r.sequence for r in replies] == [0, 1, 4, 9]
    assert [r.dropped for r in replies] == [0, 0, 2, 6]
    for reply, (_, seed) in zip(replies, frames, strict=True):
        wanted = expected(0, *observation(seed))
        np.testing.assert_allclose(numbers(reply.action), wanted, rtol=2e-5, atol=2e-6)


def test_control_takes_poses_too(client: Stub) -> None:
    situation = pb.Situation(pose=pose(), furniture=chair())
    one = pb.ControlRequest(task="sit", sequence=1, situation=situation)
    (reply,) = client.Control(iter([one]))
    other = client.ActFromPose(pb.ActFromPoseRequest(task="sit", situations=[situation]))
    np.testing.assert_allclose(numbers(reply.target), numbers(other.target), atol=1e-6)


def test_many_streams_share_batches_and_get_their_own_answers(server: Running) -> None:
    failed: list[str] = []
    wanted = [[expected(0, *observation(1000 * k + i)) for i in range(10)] for k in range(8)]

    def one(number: int) -> None:
        with stub(server) as client:
            states = [observation(1000 * number + i) for i in range(10)]
            replies = client.Control(
                pb.ControlRequest(
                    task="sit", sequence=i, observation=pb.Observation(state=s, goal=g)
                )
                for i, (s, g) in enumerate(states)
            )
            for _, reply in zip(states, replies, strict=True):
                if not np.allclose(
                    numbers(reply.action), wanted[number][reply.sequence], atol=1e-5
                ):
                    failed.append(f"{number}/{reply.sequence}")

    threads = [threading.Thread(target=one, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not failed


def test_describe_names_the_served_policies(client: Stub) -> None:
    reply = client.Describe(pb.DescribeRequest())
    assert {p.name: p.version for p in reply.policies} == {
        "sit": make(0).version,
        "other": make(1).version,
    }
    policy = reply.policies[0]
    assert [(f.name, f.width) for f in policy.state] == [(f.name, f.width) for f in STATE]
    assert sum(f.width for f in (*policy.state, *policy.goal)) == WIDTH
    assert all(f.frame and f.unit for f in (*policy.state, *policy.goal))
    kp, kd = character.gains()
    assert [s.kp for s in policy.action.servos] == kp.tolist()
    assert [s.kd for s in policy.action.servos] == kd.tolist()
    low, high = character.set_point_bounds()
    np.testing.assert_allclose(policy.action.low_rad, low, rtol=1e-6)
    np.testing.assert_allclose(policy.action.high_rad, high, rtol=1e-6)
    widths = {"ball": 4, "hinge": 1}
    assert sum(widths[j.kind] for j in reply.joints) == 36
    assert reply.control_hz == 30 and reply.simulation_hz == pytest.approx(120)
    assert policy.licence == "Apache-2.0" and policy.training_data == "none"
    assert len(client.Describe(pb.DescribeRequest(task="other")).policies) == 1


def test_health_and_reflection(server: Running) -> None:
    with grpc.insecure_channel(server.server.address) as channel:
        check = health_pb2_grpc.HealthStub(channel).Check
        assert check(health_pb2.HealthCheckRequest(service=NAME)).status == 1
        ask = reflection_pb2.ServerReflectionRequest(list_services="")
        (answer,) = reflection_pb2_grpc.ServerReflectionStub(channel).ServerReflectionInfo(
            iter([ask])
        )
        assert NAME in [s.name for s in answer.list_services_response.service]


def poisoned(table: str, at: int, value: float) -> dict[str, bytes]:
    parts = dict(zip(("state", "goal"), observation(0), strict=True))
    array = np.frombuffer(bytearray(parts[table]), "<f4")
    array[at] = value
    return {table: array.tobytes()}


def test_what_is_wrong_is_named(client: Stub) -> None:
    invalid, missing = StatusCode.INVALID_ARGUMENT, StatusCode.NOT_FOUND
    cases = [
        (act(client, task="dance"), missing, "unknown policy 'dance': choose one of other, sit"),
        (act(client, task=""), invalid, "task: missing, must be one of other, sit"),
        (act(client, state=b""), invalid, "state: 0 rows, must be 1 to 1024"),
        (act(client, state=b"1"), invalid, "state: 1 bytes, must be a multiple of 456"),
        (act(client, goal=b"12345678"), invalid, "goal: 8 bytes, must be 116 (1 rows"),
        (act(client, **poisoned("state", 0, np.nan)), invalid, "root_height[0]) is nan, must be"),
        (act(client, **poisoned("state", 113, np.inf)), invalid, "(object_rotation[5]) is inf"),
        (act(client, **poisoned("goal", 4, -np.inf)), invalid, "goal: row 0, number 4 (facing[1])"),
    ]
    for call, code, message in cases:
        found = refusal(call)
        assert found[0] is code and message in found[1], found
    # the finite ones of a batch with a bad one get their answer: huge numbers are only clipped
    huge = np.full(STATE.width, 3e38, "<f4").tobytes()
    assert np.isfinite(numbers(act(client, state=huge)().action)).all()  # pyright: ignore


def test_a_wrong_row_of_a_large_call_is_named_by_its_number(
    client: Stub, caplog: pytest.LogCaptureFixture
) -> None:
    """Rows are computed 32 at a time. A second part with a wrong row is no error of the server."""
    state, goal = observation(0, 100)
    rows = np.frombuffer(bytearray(state), "<f4").reshape(100, -1)
    rows[70, 3] = rows[97, 0] = np.nan
    found = refusal(act(client, state=rows.tobytes(), goal=goal))
    assert found[0] is StatusCode.INVALID_ARGUMENT
    assert found[1].startswith("state: row 70, number 3 (")
    act(client)()
    gc.collect()
    assert "never retrieved" not in caplog.text


def test_a_call_that_is_refused_half_way_leaves_nothing_to_compute() -> None:
    config = PolicyServiceConfig(batch=BatchConfig(max_queued_rows=64))
    with running([fixed(make())], config) as server, stub(server) as client:
        state, goal = observation(0, 100)
        found = refusal(act(client, state=state, goal=goal))
        assert found[0] is StatusCode.RESOURCE_EXHAUSTED
        act(client)()
        rows = server.server.registry.get_sample_value("policy_batch_rows_sum", {"policy": "sit"})
        assert rows == 1.0
        assert server.now(lambda: server.service.batchers["sit"].queued_rows) == 0


def test_what_is_wrong_with_a_situation_is_named(client: Stub) -> None:
    def asked(change: object, furniture: pb.Furniture | None = None) -> object:
        here = pose()
        change(here)  # pyright: ignore
        situation = pb.Situation(pose=here, furniture=furniture or chair())
        request = pb.ActFromPoseRequest(task="sit", situations=[situation])
        return lambda: client.ActFromPose(request)

    def setter(field: str, values: list[float]) -> object:
        return lambda p: (p.ClearField(field), getattr(p, field).extend(values))

    unknown, tilted, plain = chair(), chair(), chair()
    unknown.piece = "throne-test-000"
    tilted.rotation[:] = [0.7071, 0.7071, 0.0, 0.0]
    plain.ClearField("piece")
    nothing = lambda p: None  # noqa: E731
    cases = [
        (asked(setter("root_position", [1.0])), "pose.root_position: 1 numbers, must be 3"),
        (asked(setter("root_rotation", [2.0, 0, 0, 0])), "must be a unit quaternion w, x, y, z"),
        (asked(setter("root_velocity", [1e9, 0, 0])), "root_velocity[0]: 1000000000.0, must be"),
        (asked(setter("joint_velocity", [np.nan] * 28)), "joint_velocity[0]: nan, must be within"),
        (asked(setter("joint_position", [0.0] * 36)), "joint_position[0:4]: length 0.000"),
        (asked(nothing, unknown), "unknown furniture class 'throne': choose one of armchair"),
        (asked(nothing, tilted), "furniture.rotation: tilted"),
        (asked(nothing, plain), "furniture: must have a piece"),
    ]
    for call, message in cases:
        code, said = refusal(call)
        assert code is StatusCode.INVALID_ARGUMENT and message in said, said
    empty = pb.ActFromPoseRequest(task="sit", situations=[pb.Situation(pose=pose())])
    assert "furniture: missing" in refusal(lambda: client.ActFromPose(empty))[1]


def test_streams_refuse_what_they_cannot_use(client: Stub) -> None:
    state, goal = observation(0)
    seen = pb.Observation(state=state, goal=goal)

    def control(*frames: pb.ControlRequest) -> tuple[StatusCode, str]:
        return refusal(client.Control(iter(frames)))

    frame = pb.ControlRequest(task="sit", sequence=5, observation=seen)
    assert "5 after 5, must grow" in control(frame, frame)[1]
    assert "input: missing" in control(pb.ControlRequest(task="sit"))[1]
    other = pb.ControlRequest(task="other", sequence=6, observation=seen)
    assert "task: 'other' in a stream of 'sit'" in control(frame, other)[1]
    assert control(pb.ControlRequest(task="x"))[0] is StatusCode.NOT_FOUND
    assert list(client.Control(iter([]))) == []


def test_a_message_too_large_is_refused(server: Running) -> None:
    with stub(server, [("grpc.max_send_message_length", -1)]) as client:
        code, said = refusal(act(client, state=bytes(5 << 20)))
        assert code is StatusCode.RESOURCE_EXHAUSTED and "larger than max" in said
        assert client.Describe(pb.DescribeRequest()).policies
