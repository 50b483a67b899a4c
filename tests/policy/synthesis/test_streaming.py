"""Simulations beside the serving: a header, then frames, and no more made than are taken."""

import asyncio

from policy.config import SynthesisConfig
from policy.synthesis.streaming import Synthesis
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import chair, make
from world.character import model as character


async def taken(ahead: int, replies: int) -> list[pb.SynthesizeReply]:
    """The first so many replies; then the client goes."""
    request = pb.SynthesizeRequest(furniture=chair(), seconds=0.5)
    found = []
    stream = Synthesis(SynthesisConfig(buffer_frames=ahead)).run(request, make())
    async for reply in stream:
        found.append(reply)
        if len(found) == replies:
            break
    await stream.aclose()
    return found


def test_a_header_comes_first_and_then_every_frame() -> None:
    header, *frames = asyncio.run(taken(4, 12))
    assert header.header.task == "sit" and header.header.version == make().version
    assert header.header.control_hz == character.CONTROL_HZ and len(header.header.bodies) == 15
    assert not header.header.style and header.header.ball_radius_m == 0.0
    assert all(reply.WhichOneof("part") == "frame" for reply in frames) and len(frames) == 11


def test_how_many_are_made_ahead_changes_nothing() -> None:
    one, many = (asyncio.run(taken(ahead, 8)) for ahead in (1, 8))
    assert [reply.SerializeToString() for reply in one] == [
        reply.SerializeToString() for reply in many
    ]
