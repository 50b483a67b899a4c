"""Simulations beside the serving: made on threads, sent as fast as the client takes them."""

import asyncio
import itertools
from collections.abc import AsyncIterator, Iterator
from concurrent.futures import ThreadPoolExecutor

import torch

from policy.checkpoints.served import Served
from policy.config import SynthesisConfig
from policy.service import description
from policy.synthesis.simulation import Simulation
from rpc.v1 import policy_pb2 as pb
from world.character import model as character


class Synthesis:
    """Runs requests, a few at a time."""

    def __init__(self, config: SynthesisConfig) -> None:
        self._config = config
        self._threads = ThreadPoolExecutor(
            config.max_at_a_time, "synthesis", initializer=torch.set_num_threads, initargs=(1,)
        )

    async def run(
        self, request: pb.SynthesizeRequest, served: Served
    ) -> AsyncIterator[pb.SynthesizeReply]:
        """The replies to a request; nothing is made that the client is not ready to take."""
        loop = asyncio.get_running_loop()
        simulation = await loop.run_in_executor(
            self._threads, Simulation, request, served, self._config.max_s
        )
        yield pb.SynthesizeReply(header=header(simulation, served))
        frames = simulation.frames()
        while part := await loop.run_in_executor(self._threads, self._some, frames):
            for reply in part:
                yield reply

    def _some(self, frames: Iterator[pb.SynthesizeReply]) -> list[pb.SynthesizeReply]:
        return list(itertools.islice(frames, self._config.ahead))


def header(simulation: Simulation, served: Served) -> pb.SynthesisHeader:
    """What the frames of a simulation mean."""
    return pb.SynthesisHeader(
        task=served.task.name,
        version=served.version,
        control_hz=character.CONTROL_HZ,
        bodies=description.bodies(),
        joints=description.joints(),
        reward_terms=list(served.task.terms),
        boxes=[
            pb.SolidBox(centre=box.centre_m, half=box.half_m, rotation=box.quat)
            for box in simulation.props.boxes()
        ],
        style=served.style is not None,
        ball_radius_m=simulation.balls[0].radius_m if simulation.balls else 0.0,
    )
