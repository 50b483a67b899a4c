"""Simulations on threads, whose frames are streamed as fast as the client reads them."""

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
    """Runs Synthesize requests on a pool of threads."""

    def __init__(self, config: SynthesisConfig) -> None:
        self._config = config
        self._threads = ThreadPoolExecutor(
            config.max_at_a_time, "synthesis", initializer=torch.set_num_threads, initargs=(1,)
        )

    async def run(
        self, request: pb.SynthesizeRequest, served: Served
    ) -> AsyncIterator[pb.SynthesizeReply]:
        """Replies to a request, simulated only as far ahead as `buffer_frames`.

        A cancelled call stops its simulation, and counts as running until that has stopped.
        """
        cancelled = threading.Event()
        make = functools.partial(
            Simulation, request, served, self._config.max_s, cancelled=cancelled.is_set
        )
        simulation = await self._run(make, cancelled)
        yield pb.SynthesizeReply(header=header(simulation, served))
        some = functools.partial(self._next_replies, simulation.frames(), cancelled)
        while part := await self._run(some, cancelled):
            for reply in part:
                yield reply

    async def _run(self, work: Callable[[], Made], cancelled: threading.Event) -> Made:
        """Result of work on a thread; when cancelled, set the event and wait for the thread."""
        future = asyncio.get_running_loop().run_in_executor(self._threads, work)
        try:
            return await asyncio.shield(future)
        except asyncio.CancelledError:
            cancelled.set()
            await asyncio.wait([future])
            if not future.cancelled():
                future.exception()  # retrieved, so that asyncio does not log it
            raise

    def _next_replies(
        self, frames: Iterator[pb.SynthesizeReply], cancelled: threading.Event
    ) -> list[pb.SynthesizeReply]:
        made: list[pb.SynthesizeReply] = []
        while len(made) < self._config.buffer_frames and not cancelled.is_set():
            frame = next(frames, None)
            if frame is None:
                break
            made.append(frame)
        return made


def header(simulation: Simulation, served: Served) -> pb.SynthesisHeader:
    """Header of a simulation, which describes its frames."""
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
