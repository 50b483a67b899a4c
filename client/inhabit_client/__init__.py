"""Client of the policy service of `inhabit`: actions and motions of simulated characters.

    with connect("127.0.0.1:50051") as service:
        motion = service.synthesize("sit", furniture("chair-test-000"))

Metres, z up, radians, quaternions w, x, y, z.
"""

from inhabit_client.connection import Client, connect
from inhabit_client.control import Session
from inhabit_client.errors import ServiceError
from inhabit_client.motion import Frame, Motion
from inhabit_client.scene import box, furniture, pose, situation
from inhabit_client.v1 import policy_pb2 as messages

__all__ = [
    "Client",
    "Frame",
    "Motion",
    "ServiceError",
    "Session",
    "box",
    "connect",
    "furniture",
    "messages",
    "pose",
    "situation",
]
