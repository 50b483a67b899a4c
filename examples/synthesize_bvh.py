"""Requests a motion of the policy service and writes it as BVH (y up, centimetres).

inhabit serve pretrained/sit &
python examples/synthesize_bvh.py 127.0.0.1:50051 walk_and_sit.bvh
"""

import argparse

import grpc
import numpy as np

from rpc.v1 import policy_pb2 as pb
from rpc.v1 import policy_pb2_grpc

Y_UP = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]])  # our x, forwards, becomes BVH's z


def matrix(q: np.ndarray) -> np.ndarray:
    """Return the rotation matrix, in BVH's axes, of a quaternion w, x, y, z in ours."""
    w, (x, y, z) = q[0], q[1:]
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return Y_UP @ (np.eye(3) + 2 * w * cross + 2 * cross @ cross) @ Y_UP.T


def degrees(m: np.ndarray) -> list[float]:
    """Return the Z, X and Y angles of a rotation matrix, their product in this order."""
    x = np.arcsin(np.clip(m[2, 1], -1, 1))
    return np.rad2deg([np.arctan2(-m[0, 1], m[1, 1]), x, np.arctan2(-m[2, 0], m[2, 2])]).tolist()


def hierarchy(header: pb.SynthesisHeader, body: int, joints: dict[str, pb.Joint]) -> list[str]:
    """Return the lines of a body and its descendants; bodies without a joint are end sites."""
    x, y, z = 100 * Y_UP @ np.array(header.bodies[body].offset)
    offset, name = f"OFFSET {x:.5f} {y:.5f} {z:.5f}", header.bodies[body].name
    if body and name not in joints:
        return ["End Site", "{", offset, "}"]
    where = "CHANNELS 3" if body else "CHANNELS 6 Xposition Yposition Zposition"
    lines = [f"{'JOINT' if body else 'ROOT'} {name}", "{", offset]
    lines.append(f"{where} Zrotation Xrotation Yrotation")
    below = [i for i, other in enumerate(header.bodies) if other.parent == body]
    for child in below:
        lines += hierarchy(header, child, joints)
    return [*lines, *([] if below else ["End Site", "{", "OFFSET 0 10 0", "}"]), "}"]


def channels(header: pb.SynthesisHeader, frame: pb.Frame) -> list[float]:
    """Return the numbers of a frame; its joints are in the order of the hierarchy."""
    numbers = (100 * Y_UP @ np.array(frame.root_position)).tolist()
    numbers += degrees(matrix(np.array(frame.root_rotation)))
    at, rest = 0, np.array(frame.joint_position)
    for joint in header.joints:
        width = 4 if joint.kind == "ball" else 1
        own, half = rest[at : at + width], rest[at] / 2
        turned = (
            own if width == 4 else np.array([np.cos(half), *np.sin(half) * np.array(joint.axis)])
        )
        numbers, at = numbers + degrees(matrix(turned)), at + width
    return numbers


def write(address: str, out: str, piece: str = "chair-test-000", seconds: float = 10.0) -> int:
    """Write the motion of a character that is initially 3 m before a chair; return the number of
    frames."""
    request = pb.SynthesizeRequest(task="sit", furniture=pb.Furniture(piece=piece), seconds=seconds)
    request.start.standing.CopyFrom(pb.Stance(x=3, yaw_rad=np.pi))
    # a proxy of the environment (http_proxy) does not reach this machine
    direct = [("grpc.enable_http_proxy", 0)]
    with grpc.insecure_channel(address, direct) as channel:
        header, *frames = policy_pb2_grpc.PolicyStub(channel).Synthesize(request)
    rows = [channels(header.header, f.frame) for f in frames if f.HasField("frame")]
    lines = hierarchy(header.header, 0, {joint.body: joint for joint in header.header.joints})
    lines = ["HIERARCHY", *lines, "MOTION", f"Frames: {len(rows)}"]
    lines.append(f"Frame Time: {1 / header.header.control_hz:.7f}")
    lines += [" ".join(f"{number:.5f}" for number in row) for row in rows]
    with open(out, "w") as file:
        file.write("\n".join(lines) + "\n")
    return len(rows)


if __name__ == "__main__":
    lines = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=lines)
    parser.add_argument("address", nargs="?", default="127.0.0.1:50051", help="of the service")
    parser.add_argument("out", nargs="?", default="motion.bvh", help="file to write")
    parser.add_argument("piece", nargs="?", default="chair-test-000", help="piece of furniture")
    parser.add_argument("seconds", nargs="?", type=float, default=10.0, help="longest time, s")
    given = parser.parse_args()
    try:
        frames = write(given.address, given.out, given.piece, given.seconds)
    except grpc.RpcError as error:
        parser.exit(1, f"{parser.prog}: {error.details()}\n")
    print(f"{given.out}: {frames} frames")
