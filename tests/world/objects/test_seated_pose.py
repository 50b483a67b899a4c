"""Seated poses are within the joints' ranges and off the floor."""

import mujoco
import numpy as np

from world.character import model as character
from world.furniture.piece import SeatTarget
from world.objects import seated_pose


def test_seated_poses_are_in_the_joints_ranges_and_off_the_floor() -> None:
    model = mujoco.MjModel.from_xml_string(character.spec().to_xml())
    data = mujoco.MjData(model)
    low, high = character.set_point_bounds()
    for height in (0.2, 0.35, 0.45, 0.6, 0.8):
        for pose in seated_pose.poses():
            place = SeatTarget((0.0, 0.0, height))
            targets = seated_pose.set_points(place, pose)
            assert (targets >= low - 1e-9).all()
            assert (targets <= high + 1e-9).all()
            data.qpos[:] = seated_pose.qpos(place, 0.0, pose)
            mujoco.mj_forward(model, data)
            thighs = [data.geom(f"{side}_thigh").xpos[2] for side in ("left", "right")]
            assert np.allclose(thighs, height + seated_pose.THIGH_M, atol=0.03)
            # soles 0.05 below the ankles
            feet = [data.body(f"{side}_foot").xpos[2] - 0.05 for side in ("left", "right")]
            assert min(feet) > -0.03
