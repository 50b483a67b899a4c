"""Inverse kinematics: joints within their ranges, and targets that a clip's own pose meets."""

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from world import rotations
from world.character import kinematics
from world.character import model as character
from world.motions.clip import Clip
from world.motions.retarget import solve
from world.motions.retarget.body import Targets


def test_joints_beyond_their_ranges_are_brought_back() -> None:
    low, high = character.set_point_bounds()
    qpos = np.tile(character.standing_qpos(), (2, 1))
    address = character.HINGE_QPOS[0]
    row = next(
        sum(len(j.range_deg) for j in character.JOINTS[:i])
        for i, joint in enumerate(character.JOINTS)
        if not joint.is_ball
    )
    qpos[0, address], qpos[1, address] = 9.0, -9.0
    ball = character.BALL_QPOS[0]
    qpos[0, ball : ball + 4] = Rotation.from_rotvec([3.0, 0, 0]).as_quat(scalar_first=True)
    found = solve.within_ranges(qpos)
    assert found[:, address].tolist() == [high[row], low[row]]
    turned = Rotation.from_quat(found[0, ball : ball + 4], scalar_first=True).as_rotvec()
    assert abs(turned[0]) < 3.0 and not turned[1:].any()
    standing = solve.within_ranges(character.standing_qpos()[None])
    np.testing.assert_allclose(standing[0], character.standing_qpos(), atol=1e-12)


def test_a_pose_that_meets_its_targets_stays(walking: Clip) -> None:
    clip = walking.part(0, 3)
    local = rotations.matrix(torch.from_numpy(clip.local_rotation).double())
    position, rotation = kinematics.forward(torch.from_numpy(clip.root_position_m).double(), local)
    place = position.numpy()
    target = Targets(place[:, 0], rotation.numpy(), place[:, [11, 14]], place[:, [5, 8]])
    root, found = solve.solved(target)
    np.testing.assert_allclose(root, clip.root_position_m, atol=3e-3)
    again, _ = kinematics.forward(torch.from_numpy(root), rotations.matrix(torch.from_numpy(found)))
    np.testing.assert_allclose(again[:, [11, 14]], place[:, [11, 14]], atol=5e-3)
    np.testing.assert_allclose(again[:, [5, 8]], place[:, [5, 8]], atol=1e-2)
