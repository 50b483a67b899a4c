"""Simulations beside the serving: made on threads, sent as fast as the client takes them."""

import asyncio
import functools
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import torch

from policy.checkpoints.served import Served
from policy.config import SynthesisConfig
from policy.messages import description
from policy.synthesis.simulation import Simulation
from rpc.v1 import policy_pb2 as pb
from world.character import model as character

Made = TypeVar("Made")


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
        """The replies to a request; nothing is made that the client is not ready to take.

        A client that gives up ends what is being made for it, and is counted until it has ended.
        """
        gone = threading.Event()
        make = functools.partial(Simulation, request, served, self._config.max_s, gone=gone.is_set)
        simulation = await self._whole(make, gone)
        yield pb.SynthesizeReply(header=header(simulation, served))
        some = functools.partial(self._some, simulation.frames(), gone)
        while part := await self._whole(some, gone):
            for reply in part:
                yield reply

    async def _whole(self, work: Callable[[], Made], gone: threading.Event) -> Made:
        """What work on a thread gives; cancelled, it tells the work and waits for its end."""
        future = asyncio.get_running_loop().run_in_executor(self._threads, work)
        try:
            return await asyncio.shield(future)
        except asyncio.CancelledError:
            gone.set()
            await asyncio.wait([future])
            if not future.cancelled():
                future.exception()  # nobody is there to be told
            raise

    def _some(
        self, frames: Iterator[pb.SynthesizeReply], gone: threading.Event
    ) -> list[pb.SynthesizeReply]:
        made: list[pb.SynthesizeReply] = []
        while len(made) < self._config.ahead and not gone.is_set():
            frame = next(frames, None)
            if frame is None:
                break
            made.append(frame)
        return made


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
