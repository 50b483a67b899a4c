"""Messages to rows of numbers, against MuJoCo, and what is wrong with them by field."""

import re

import mujoco
import numpy as np
import pytest

from policy.errors import RequestError
from policy.messages import requests
from policy.objects.columns import COLUMNS, POSE_WIDTH
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import SIT, WIDTH, chair, observation, pose
from world import tasks
from world.character import model as character
from world.character.features import STATE


def test_velocities_are_mujocos() -> None:
    """The root turns by its angular velocity, which messages give in the world's axes."""
    message = pose(1.0, 2.0, 0.7)
    message.root_rotation[:] = [0.5, 0.5, 0.5, 0.5]
    message.root_angular_velocity[:] = [0.3, -0.2, 0.9]
    message.root_velocity[:] = [1.0, 0.0, 0.5]
    qpos, qvel = requests.coordinates(message, "pose")
    model = character.spec().compile()
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = qpos, qvel
    mujoco.mj_forward(model, data)
    found = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, 1, found, 0)
    np.testing.assert_allclose(found, [0.3, -0.2, 0.9, 1.0, 0.0, 0.5], atol=1e-12)


def test_a_pose_does_not_depend_on_where_in_the_world_it_is() -> None:
    rows = [
        requests.pose(pb.Situation(pose=pose(x, y), furniture=chair(x + 2.0, y)), SIT, "situation")
        for x, y in ((0.0, 0.0), (80000.5, -300.25))
    ]
    for name in ("qpos", "qvel", "point", "facing", "corners", "head"):
        part = COLUMNS[name]
        np.testing.assert_allclose(rows[0][part], rows[1][part], atol=1e-9, err_msg=name)
    assert rows[0].shape == (POSE_WIDTH,) and rows[0][COLUMNS["qpos"]][:2].tolist() == [0.0, 0.0]
    assert rows[0][COLUMNS["point"]][0] == pytest.approx(2.0, abs=0.5)


def test_what_is_wrong_is_named_by_field() -> None:
    short, long = pose(), pose()
    short.joint_position[:] = [0.0] * 5
    long.joint_position[:4] = [2.0, 0.0, 0.0, 0.0]
    for message, said in (
        (pb.Situation(furniture=chair()), "s.pose: missing"),
        (pb.Situation(pose=pose()), "s.furniture: missing, 'sit' needs it"),
        (pb.Situation(pose=short, furniture=chair()), "s.pose.joint_position: 5 numbers, must be"),
        (pb.Situation(pose=long, furniture=chair()), "s.pose.joint_position[0:4]: length 2.000"),
    ):
        with pytest.raises(RequestError, match=re.escape(said)):
            requests.pose(message, SIT, "s")
    for rows in (0, 5):
        said = rf"^situations: {rows} rows, must be 1 to 4$"
        with pytest.raises(RequestError, match=said):
            requests.count(rows, "situations", 4)


def test_observations_are_put_side_by_side() -> None:
    state, goal = observation(3, rows=5)
    widths = (STATE.width, SIT.goal.width)
    data, rows = requests.observation(state, goal, widths, 5)
    both = np.frombuffer(data, "<f4").reshape(rows, WIDTH)
    np.testing.assert_array_equal(both[:, : STATE.width].tobytes(), state)
    np.testing.assert_array_equal(both[:, STATE.width :].tobytes(), goal)
    for wrong, said in (
        ((state[:-1], goal, widths, 5), "state: .* must be a multiple of 456"),
        ((state, goal[4:], widths, 5), "goal: .*5 rows, as state has"),
        ((state, goal, widths, 4), "state: 5 rows, must be 1 to 4"),
    ):
        with pytest.raises(RequestError, match=said):
            requests.observation(*wrong)


def test_noise_is_the_seeds_and_the_counters() -> None:
    first = requests.noise(7, 0, 2000)
    assert first.shape == (2000, 28) and abs(first.mean()) < 0.02 and abs(first.std() - 1) < 0.02
    np.testing.assert_array_equal(first, requests.noise(7, 0, 2000))
    assert (first != requests.noise(7, 1, 2000)).mean() > 0.99
    assert (first != requests.noise(8, 0, 2000)).mean() > 0.99


def test_a_wrong_object_is_named_with_its_situation() -> None:
    """Of hundreds of a request, which one."""
    right = pb.Situation(pose=pose(), furniture=chair(2.0, 0.0))
    wrong = pb.Situation(pose=pose(), furniture=chair(2.0, 0.0))
    wrong.furniture.place = 9
    with pytest.raises(RequestError, match=r"^situations\[6\]\.furniture\.place: 9, must be"):
        requests.poses([right, wrong], SIT, first=5)
    walk = tasks.make("walk")
    with pytest.raises(RequestError, match=r"^situations\[0\]\.furniture: this task needs no"):
        requests.poses([wrong], walk)
