"""Skeletons of clips: the same bodies in every rest pose, and a root on the floor."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from console.animation import skeleton
from console.animation.skeleton import Y_UP, of_clip
from tests.support.console.motions import bodies, sits, walk, wild, y_up
from world.character import model as character


@pytest.mark.parametrize("rest", ["hanging", "t-pose"])
@pytest.mark.parametrize("root_motion", [False, True])
def test_bodies_are_where_mujoco_has_them(rest: skeleton.Rest, root_motion: bool) -> None:
    made = of_clip(sits(), rest, root_motion)
    columns = [made.names.index(body) for body in character.BODIES]
    position, _ = made.world
    np.testing.assert_allclose(position[:, columns], bodies(sits())[0], atol=2e-6)


def test_without_rotation_it_stands_in_a_t_pose() -> None:
    made = of_clip(wild(), "t-pose")
    at = np.zeros((15, 3))
    for joint, parent in enumerate(made.parents):
        if parent >= 0:
            at[joint] = at[parent] + made.offsets[joint]
    hand, shoulder = made.names.index("left_hand"), made.names.index("left_upper_arm")
    np.testing.assert_allclose(at[hand] - at[shoulder], (0, 0.274788 + 0.258947, 0), atol=1e-6)
    right = at[made.names.index("right_hand")]
    np.testing.assert_allclose(right, at[hand] * (1, -1, 1), atol=1e-6)
    np.testing.assert_allclose(
        at[made.names.index("left_foot")], (0, 0.084887, -0.421546 - 0.40987), atol=1e-6
    )
    # the hand's end goes on along the arm
    np.testing.assert_allclose(made.ends[hand], (0, 0.04, 0), atol=1e-9)


def test_other_axes_and_units() -> None:
    made = of_clip(walk()).turned(Y_UP).scaled(100.0)
    np.testing.assert_allclose(made.world[0], 100 * y_up(bodies(walk())[0]), atol=2e-4)


def test_the_root_is_on_the_floor_below_the_pelvis_and_heads_as_it_does() -> None:
    made = of_clip(walk(), root_motion=True)
    assert made.names[:2] == ("root", "pelvis") and made.parents[:2] == (-1, 0)
    root, pelvis = made.moves[0], walk().root_position_m
    np.testing.assert_allclose(root[:, :2], pelvis[:, :2], atol=1e-6)
    np.testing.assert_array_equal(root[:, 2], 0.0)
    ahead = made.local[:, 0, :, 0]
    moved = np.diff(pelvis[:, :2], axis=0)
    moved /= np.linalg.norm(moved, axis=1, keepdims=True)
    # it walks where it heads
    assert (np.sum(moved * ahead[1:, :2], axis=1) > 0.95).all()
    np.testing.assert_allclose(made.local[:, 0, :, 2], np.tile((0, 0, 1.0), (len(root), 1)))
    # the pelvis is straight above it
    np.testing.assert_allclose(made.moves[1][:, :2], 0.0, atol=1e-6)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
@pytest.mark.parametrize("pitch", [0.0, -1.5707, 1.5707, 0.6])
def test_a_heading_also_of_one_who_lies(yaw: float, pitch: float) -> None:
    """On the back the forward axis is vertical, on the belly too: the left axis tells."""
    turn = Rotation.from_euler("ZY", [[yaw, pitch]]).as_matrix()
    assert skeleton.heading(turn)[0] == pytest.approx(yaw, abs=1e-3)


def test_a_heading_goes_on_over_a_full_turn_and_through_what_has_none() -> None:
    yaw = np.linspace(0.0, 4 * np.pi, 90)
    turn = Rotation.from_euler("Z", yaw[:, None]).as_matrix()
    np.testing.assert_allclose(skeleton.heading(turn), yaw, atol=1e-9)
    # forward up and left up at once cannot be; a half-way pose has no horizontal sum
    odd = turn.copy()
    odd[40] = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) * np.array([1, -1, -1.0])
    found = skeleton.heading(odd)
    assert found[40] == pytest.approx(found[39]) and found[41] == pytest.approx(yaw[41])
