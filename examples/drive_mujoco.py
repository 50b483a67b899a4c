"""Drives the character in a separate MuJoCo simulation: sends poses, receives set-points.

inhabit serve pretrained/sit & python examples/drive_mujoco.py 127.0.0.1:50051
"""

import argparse
import queue

import grpc
import mujoco
import numpy as np

from rpc.v1 import policy_pb2 as pb
from rpc.v1 import policy_pb2_grpc

BOXES = [((0, 0, 0.42), (0.22, 0.22, 0.03)), ((-0.2, 0, 0.7), (0.02, 0.22, 0.25)),
         ((0, 0, 0.2), (0.15, 0.15, 0.2))]  # fmt: skip
CHAIR = pb.Furniture(position=[1.5, 0, 0], rotation=[0, 0, 0, 1])  # turned to the character
CHAIR.custom.CopyFrom(pb.Shape(low=[-0.22, -0.22, 0], high=[0.22, 0.22, 0.95], hip=[0, 0, 0.45]))


def pose(data: mujoco.MjData) -> pb.Pose:
    """Return the simulator's state as a pose message; its angular velocity is in world axes."""
    q, v, spin = data.qpos, data.qvel, np.zeros(3)
    mujoco.mju_rotVecQuat(spin, v[3:6], q[3:7])
    return pb.Pose(root_position=q[:3], root_rotation=q[3:7], root_angular_velocity=spin,
                   root_velocity=v[:3], joint_position=q[7:], joint_velocity=v[6:])  # fmt: skip


def drive(address: str, seconds: float = 10.0) -> np.ndarray:
    """Simulate for `seconds`; return the root's positions [T, 3] m, one per control step."""
    # a proxy of the environment (http_proxy) does not reach this machine
    with grpc.insecure_channel(address, [("grpc.enable_http_proxy", 0)]) as channel:
        stub = policy_pb2_grpc.PolicyStub(channel)
        info = stub.Describe(pb.DescribeRequest(task="sit"))
        spec, solid = mujoco.MjSpec.from_string(info.mjcf), {"contype": 2, "conaffinity": 1}
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05], **solid)
        chair = spec.worldbody.add_body(pos=CHAIR.position, quat=CHAIR.rotation)
        for centre, half in BOXES:
            chair.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=centre, size=half, **solid)
        model, frames, path = spec.compile(), queue.SimpleQueue(), []
        # as in training, torques are limited once a control step, and here instead of in the model
        model.actuator_forcelimited[:] = model.actuator_ctrllimited[:] = False
        kp, kd, top = np.array([(s.kp, s.kd, s.limit_nm) for s in info.policies[0].action.servos]).T
        data, replies = mujoco.MjData(model), stub.Control(iter(frames.get, None))
        for k in range(round(seconds * info.control_hz)):
            now = pb.Situation(pose=pose(data), furniture=CHAIR)
            frames.put(pb.ControlRequest(task="sit", sequence=k, situation=now))
            mujoco.mj_forward(model, data)
            target, here = np.frombuffer(next(replies).target, "<f4"), data.actuator_length
            slowed = kd * data.actuator_velocity
            data.ctrl[:] = here + (np.clip(kp * (target - here) - slowed, -top, top) + slowed) / kp
            mujoco.mj_step(model, data, round(info.simulation_hz / info.control_hz))
            path.append(data.qpos[:3].copy())
        frames.put(None)
    return np.array(path)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("address", nargs="?", default="127.0.0.1:50051", help="of the service")
    try:
        hip = drive(parser.parse_args().address)[-1].round(2)
    except grpc.RpcError as error:
        parser.exit(1, f"{parser.prog}: {error.details()}\n")
    print("the hip ends at", hip, "m; the seat is at 1.5, 0, 0.45")
