"""gRPC service of policies: batching, reload of checkpoints, and simulation."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from typing import Any

import grpc
import torch
from prometheus_client import Counter, Gauge, Histogram

from policy.checkpoints.reload import Follower, Source, counters
from policy.checkpoints.served import STATE_WIDTH, Served
from policy.config import PolicyServiceConfig
from policy.errors import BusyError, RequestError
from policy.messages import description, requests
from policy.service.batching import PART_ROWS, Answer, Batcher, BatchMetrics, turns
from policy.service.streams import Stream, Streams
from policy.synthesis.streaming import Synthesis
from rpc.aio_server import AioServer
from rpc.server import ServerConfig, stopping
from rpc.v1 import policy_pb2 as pb
from rpc.v1 import policy_pb2_grpc
from world.errors import ChoiceError, ConfigError, InhabitError
from world.tasks import Task

NAME = "rpc.v1.Policy"
#: One Control frame in so many is timed; timing costs a few microseconds.
_SAMPLED = 32
#: Situations that are read without a pause, which takes half a millisecond.
_PART = 4
ERRORS: dict[type[Exception], grpc.StatusCode] = {
    ChoiceError: grpc.StatusCode.NOT_FOUND,
    BusyError: grpc.StatusCode.RESOURCE_EXHAUSTED,
    InhabitError: grpc.StatusCode.INVALID_ARGUMENT,
}


class PolicyService(policy_pb2_grpc.PolicyServicer):
    """Servicer of one or more policies by name, on one event loop."""

    def __init__(
        self, followers: Sequence[Follower], config: PolicyServiceConfig, server: AioServer
    ) -> None:
        self.config = config
        self.followers = {follower.served.name: follower for follower in followers}
        registry = server.registry
        metrics = BatchMetrics(registry)
        reloads, refusals = counters(registry)
        for name, follower in self.followers.items():
            follower.observe(reloads.labels(name), refusals.labels(name))
        self.batchers = {
            name: Batcher(_served(follower), config.batch, metrics)
            for name, follower in self.followers.items()
        }
        frames = [5e-4, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3, 33e-3, 66e-3, 0.2]
        self._frame_s = Histogram(
            "policy_frame_seconds", f"From a Control frame to its reply, one in {_SAMPLED}.",
            registry=registry, buckets=frames,
        )  # fmt: skip
        self._dropped = Counter("policy_dropped_frames", "Missing frames.", registry=registry)
        open_streams = Gauge("policy_streams", "Control streams open.", registry=registry)
        syntheses = Gauge("policy_syntheses", "Syntheses going on.", registry=registry)
        self.streams = Streams("Control streams", config.max_streams, open_streams)
        self.syntheses = Streams("syntheses", config.synthesis.max_at_a_time, syntheses)
        self._parsing = asyncio.Lock()
        self._synthesis = Synthesis(config.synthesis)
        self._limits = pb.Limits(
            max_rows=config.max_rows,
            max_queued_rows=config.batch.max_queued_rows,
            max_streams=config.max_streams,
            max_syntheses=config.synthesis.max_at_a_time,
            max_message_bytes=server.config.max_message_bytes,
            max_synthesis_s=config.synthesis.max_s,
        )

    def _named(self, task: str) -> str:
        """Name of the policy of a request; RequestError or ChoiceError if there is none."""
        if task in self.followers:
            return task
        if not task and len(self.followers) == 1:
            return next(iter(self.followers))
        if not task:
            names = ", ".join(sorted(self.followers))
            raise RequestError(f"task: missing, must be one of {names}")
        raise ChoiceError("policy", task, list(self.followers))

    async def Describe(
        self, request: pb.DescribeRequest, context: grpc.aio.ServicerContext
    ) -> pb.DescribeReply:
        """See policy.proto."""
        names = [self._named(request.task)] if request.task else list(self.followers)
        found = [self.followers[name] for name in names]
        policies = [description.policy(f.served, f.reloads, f.last_refusal) for f in found]
        return description.everything(policies, self._limits)

    async def Act(self, request: pb.ActRequest, context: grpc.aio.ServicerContext) -> pb.ActReply:
        """See policy.proto."""
        name = self._named(request.task)
        widths = _widths(self.followers[name].served)
        data, rows = requests.observation(request.state, request.goal, widths, self.config.max_rows)
        seed = request.seed if request.HasField("seed") else None
        return await self._answer(name, data, rows, False, seed)

    async def ActFromPose(
        self, request: pb.ActFromPoseRequest, context: grpc.aio.ServicerContext
    ) -> pb.ActReply:
        """See policy.proto."""
        name = self._named(request.task)
        task = self.followers[name].served.task
        data, rows = await self._poses(request.situations, task)
        seed = request.seed if request.HasField("seed") else None
        return await self._answer(name, data, rows, True, seed)

    async def _poses(self, messages: Sequence[pb.Situation], task: Task) -> tuple[bytes, int]:
        """As `requests.poses`, in parts, one large call at a time, so that streams are served after
        each part."""
        requests.count(len(messages), "situations", self.config.max_poses)
        if len(messages) <= _PART:
            return requests.poses(messages, task)
        found = []
        async with self._parsing:
            for first in range(0, len(messages), _PART):
                part, _ = requests.poses(messages[first : first + _PART], task, first)
                found.append(part)
                await turns()
        return b"".join(found), len(messages)

    async def _answer(
        self, name: str, data: bytes, rows: int, posed: bool, seed: int | None
    ) -> pb.ActReply:
        batcher = self.batchers[name]
        noise = None if seed is None else requests.noise(seed, 0, rows)
        # in parts, so that a large call does not delay the streams
        most, size = min(PART_ROWS, self.config.batch.max_rows), len(data) // rows
        found: list[Answer] = []
        batcher.calls += 1
        try:
            while len({part.version for part in found}) != 1:  # no mixture of two checkpoints
                parts: list[asyncio.Future[Answer]] = []
                for first in range(0, rows, most):
                    own = None if noise is None else noise[first : first + most]
                    part = data[first * size : (first + most) * size]
                    try:
                        parts.append(
                            batcher.submit(part, min(most, rows - first), posed, own, first)
                        )
                    except BusyError:
                        for queued in parts:
                            queued.cancel()  # nobody waits for them any more
                        raise
                found = await _answers(parts)
        finally:
            batcher.calls -= 1
        return pb.ActReply(
            action=b"".join(part.action for part in found),
            target=b"".join(part.target for part in found),
            version=found[-1].version,
        )

    async def Control(self, request_iterator: Any, context: grpc.aio.ServicerContext) -> None:
        """See policy.proto."""
        with self.streams.one() as stream:
            first: pb.ControlRequest | Any = await context.read()
            if first is grpc.aio.EOF:
                return
            name = self._named(first.task)
            batcher = self.batchers[name]
            batcher.streams += 1
            try:
                await self._control(name, first, stream, context)
            finally:
                batcher.streams -= 1

    async def _control(
        self,
        name: str,
        request: pb.ControlRequest | Any,
        stream: Stream,
        context: grpc.aio.ServicerContext,
    ) -> None:
        """Answer the frames of one character until the client ends the stream."""
        served = self.followers[name].served
        task, widths = served.task, _widths(served)
        clock = asyncio.get_running_loop().time
        submit, read, write = self.batchers[name].submit, context.read, context.write
        last, dropped = -1, 0
        while request is not grpc.aio.EOF:
            began = clock()
            sequence = request.sequence
            if sequence <= last:
                raise RequestError(f"sequence: {sequence} after {last}, must grow")
            if request.task and request.task != name:
                raise RequestError(f"task: '{request.task}' in a stream of '{name}'")
            if last >= 0 and sequence > last + 1:
                dropped += sequence - last - 1
                self._dropped.inc(sequence - last - 1)
            last = sequence
            kind = request.WhichOneof("input")
            if kind == "observation":
                own = request.observation
                data, _ = requests.observation(own.state, own.goal, widths, 1)
            elif kind == "situation":
                data, _ = requests.poses([request.situation], task)
            else:
                raise RequestError("input: missing, must be an observation or a situation")
            noise = requests.noise(request.seed, sequence, 1) if request.HasField("seed") else None
            answer: Answer = await submit(data, 1, kind == "situation", noise)
            stream.writes()
            await write(
                pb.ControlReply(
                    sequence=sequence,
                    action=answer.action,
                    target=answer.target,
                    version=answer.version,
                    dropped=dropped,
                )
            )
            if sequence % _SAMPLED == 0:
                self._frame_s.observe(clock() - began)
            stream.reads()
            request = await read()

    async def Synthesize(
        self, request: pb.SynthesizeRequest, context: grpc.aio.ServicerContext
    ) -> None:
        """See policy.proto."""
        served = self.followers[self._named(request.task)].served
        with self.syntheses.one() as stream:
            stream.works()  # a mesh of the request may take minutes to be decomposed
            async for part in self._synthesis.run(request, served):
                stream.writes()
                await context.write(part)
                stream.works()

    async def watch(self) -> None:
        """Poll checkpoints and end idle streams, until cancelled."""
        since = 0.0
        while True:
            await asyncio.sleep(min(1.0, self.config.poll_s))
            since += min(1.0, self.config.poll_s)
            for streams in (self.streams, self.syntheses):
                streams.end_idle(self.config.idle_s, self.config.stalled_s)
            if since >= self.config.poll_s:
                since = 0.0
                for follower in self.followers.values():
                    follower.watch()

    async def end_streams(self) -> None:
        """Close the open streams, before the server stops."""
        for streams in (self.streams, self.syntheses):
            streams.end_all("the server is shutting down: connect to another, or again later")
        await asyncio.sleep(0)


async def _answers(parts: Sequence["asyncio.Future[Answer]"]) -> list[Answer]:
    """The answers to the parts of a call; the first part's error where any has one. A call that is
    cancelled leaves no part behind."""
    if len(parts) == 1:
        return [await parts[0]]
    found: list[Answer] = []
    for part in await asyncio.gather(*parts, return_exceptions=True):
        if isinstance(part, BaseException):
            raise part
        found.append(part)
    return found


def _served(follower: Follower) -> Callable[[], Served]:
    return lambda: follower.served


def _widths(served: Served) -> tuple[int, int]:
    return STATE_WIDTH, served.width - STATE_WIDTH


@asynccontextmanager
async def serving(
    sources: Sequence[Source],
    server_config: ServerConfig,
    config: PolicyServiceConfig | None = None,
    report: Callable[[str], None] | None = None,
) -> AsyncIterator[tuple[AioServer, PolicyService]]:
    """Run a server of policies within a `with`, and drain it at the end.

    Raises InhabitError where a policy cannot be served, RpcError where the address cannot be used.
    """
    torch.set_num_threads(1)
    names = [source.name for source in sources]
    if len(set(names)) != len(names):
        raise ConfigError(f"policies {', '.join(names)}: each needs a name of its own, NAME=RUN")
    server = AioServer(server_config, ERRORS)
    service = PolicyService(
        [Follower(s, report) for s in sources], config or PolicyServiceConfig(), server
    )
    server.add(policy_pb2_grpc.add_PolicyServicer_to_server, service)
    await server.start([NAME])
    watch = asyncio.ensure_future(service.watch())
    try:
        yield server, service
    finally:
        watch.cancel()
        for follower in service.followers.values():
            follower.close()
        await server.drain(service.end_streams)


async def serve(
    sources: Sequence[Source],
    server_config: ServerConfig,
    config: PolicyServiceConfig | None = None,
    report: Callable[[str], None] | None = None,
    started: Callable[[AioServer, PolicyService], None] = lambda server, service: None,
) -> bool:
    """Serve until SIGTERM or SIGINT, then drain; return whether SIGINT came first.

    started: called once the server runs.
    """
    async with serving(sources, server_config, config, report) as (server, service):
        server.catch_signals()
        started(server, service)
        interrupted = await server.wait()
        if report is not None:
            with contextlib.suppress(OSError):  # nobody may read it any more
                report(stopping(server_config.drain_s))
    return interrupted
