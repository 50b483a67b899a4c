"""Joint limits hold, and nothing sinks."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tests.support import foreign_motions
from world.character import model as character
from world.motions import measures
from world.motions.clip import Clip
from world.motions.formats import own
from world.motions.retarget import body, limits, solve


def test_limits_hold_and_nothing_sinks(walking: Clip) -> None:
    # a recording that does what no joint can, 20 cm below the floor
    local = walking.local_rotation[:12].astype(float).copy()
    local[:, 9] = Rotation.from_rotvec([1.6, 0.4, 1.2]).as_quat(scalar_first=True)
    local[:, 3] = Rotation.from_rotvec([1.5, 0, 1.9]).as_quat(scalar_first=True)
    root = walking.root_position_m[:12].astype(float) - [0, 0, 0.2]
    turn = Rotation.from_quat(local.reshape(-1, 4), scalar_first=True).as_matrix()
    position, rotation = foreign_motions.forward(
        character.PARENTS, own.offsets(), turn.reshape(-1, 15, 3, 3), root
    )
    target = body.Targets(position[:, 0], rotation, position[:, [11, 14]], position[:, [5, 8]])
    place, quaternion = solve.solved(target)
    clip = Clip("x", 30, place, quaternion, "", "")
    share, most, _ = measures.past_limits(clip)
    assert share == 0, np.rad2deg(most)
    assert measures.penetration_m(clip) < 0.005


def test_joint_ranges_are_linear_in_the_step() -> None:
    """d(rotation vector) of ball joints against finite differences."""
    generator = np.random.default_rng(2)
    model = character.spec().compile()
    qpos = character.standing_qpos()
    for address in character.BALL_QPOS:
        turn = Rotation.from_rotvec(generator.uniform(-1.2, 1.2, 3))
        qpos[address : address + 4] = turn.as_quat(scalar_first=True)
    vector, jacobian = limits.axes(qpos)
    for joint, dof in enumerate(character.BALL_DOF):
        for axis in range(3):
            step = np.zeros(character.NV)
            step[dof + axis] = 1e-6
            moved = qpos.copy()
            mujoco.mj_integratePos(model, moved, step, 1.0)
            slope = (limits.axes(moved)[0][joint] - vector[joint]) / 1e-6
            np.testing.assert_allclose(jacobian[joint][:, axis], slope, atol=1e-5)
