"""gRPC service of a `Discriminator`."""

import hashlib
import hmac
import json
import secrets
import threading
import time
from collections.abc import Iterator
from dataclasses import asdict

import grpc
from prometheus_client import Gauge

from discriminator.client import MOCAP_MEAN, TRAINING
from discriminator.errors import StyleError, TurnError
from discriminator.journal import Journal
from discriminator.messages import rollout_of, state_chunks, state_of
from discriminator.trainer import Discriminator
from rpc.errors import CodecError
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc
from world.errors import InhabitError, LayoutError

NAME = "rpc.v1.Style"
ERRORS: dict[type[Exception], grpc.StatusCode] = {
    TurnError: grpc.StatusCode.FAILED_PRECONDITION,
    StyleError: grpc.StatusCode.INVALID_ARGUMENT,
    LayoutError: grpc.StatusCode.INVALID_ARGUMENT,
    InhabitError: grpc.StatusCode.INVALID_ARGUMENT,
}


class StyleService(style_pb2_grpc.StyleServicer):
    """Servicer of scoring and training; one call at a time uses the discriminator."""

    def __init__(self, style: Discriminator, journal: Journal | None = None) -> None:
        """journal: its state is loaded if it has one."""
        self._style, self._journal = style, journal
        self._lock = threading.Lock()
        self._instance = secrets.token_hex(8)
        self._began = time.monotonic()
        self._training = ""
        """Digest of the id of the training that the service belongs to; empty: to calls without
        one"""
        saved = journal.load() if journal else None
        if saved is not None:
            style.load_state_dict(saved)
        if journal is not None:
            self._training = journal.training()

    def Score(
        self, request_iterator: Iterator[pb.ScoreChunk], context: grpc.ServicerContext
    ) -> pb.ScoreReply:
        """See style.proto."""
        self._own(context)
        first = next(request_iterator, None)
        if first is None or first.WhichOneof("part") != "header":
            raise CodecError("header: must come first")
        header = first.header
        rollout = rollout_of(header, request_iterator, self._style.width)
        with self._lock:
            self._own(context)
            known = self._style.has_scores(header.batch)
            if header.HasField("version") and not known and header.version != self._style.version:
                raise TurnError(
                    f"header.version: {header.version}, must be {self._style.version} (the "
                    "service's own): restore the service from the run's checkpoint"
                )
            scores = self._style.score(header.batch, **rollout)
        reward = scores.reward.numpy().astype("<f4", copy=False).tobytes()
        return pb.ScoreReply(reward=reward, version=scores.version, metrics=scores.metrics)

    def Train(self, request: pb.TrainRequest, context: grpc.ServicerContext) -> pb.TrainReply:
        """See style.proto."""
        with self._lock:
            self._own(context)
            style = self._style
            fresh = request.version == style.version
            if fresh and request.HasField("batch") and request.batch != style.last_batch:
                raise TurnError(
                    f"train: batch {request.batch} was to be scored before, but the last was "
                    f"{style.last_batch}: score it again"
                )
            metrics = style.train(request.version)
            if fresh:
                self._save(new=False)
            return pb.TrainReply(version=style.version, metrics=metrics)

    def Status(self, request: pb.StatusRequest, context: grpc.ServicerContext) -> pb.StatusReply:
        """See style.proto."""
        style = self._style
        return pb.StatusReply(
            version=style.version,
            batches=style.batches,
            transitions=style.transitions,
            last_batch=style.last_batch,
            replay_size=style.replay.size,
            replay_capacity=style.replay.capacity,
            width=style.width,
            config=json.dumps(asdict(style.config) | {MOCAP_MEAN: style.mocap_mean}),
            instance=self._instance,
            uptime_s=time.monotonic() - self._began,
        )

    def Checkpoint(
        self, request: pb.CheckpointRequest, context: grpc.ServicerContext
    ) -> Iterator[pb.StateChunk]:
        """See style.proto."""
        with self._lock:
            state = self._style.state_dict()
        yield from state_chunks(state)

    def Restore(
        self, request_iterator: Iterator[pb.StateChunk], context: grpc.ServicerContext
    ) -> pb.RestoreReply:
        """See style.proto."""
        state = state_of(request_iterator, self._style.state_bytes)
        with self._lock:
            # the first training that restores a service has it: whoever else has the token could
            # replace the discriminator of a training that goes on
            if self._training:
                self._own(context)
            self._style.check_state(state)
            if "replay" not in state:
                raise LayoutError("discriminator state: replay is missing")
            if self._journal is not None:
                # a kill in between would leave the replay of one state and the rest of another
                self._journal.clear()
                self._journal.set_training(training_of(context))
            self._training = training_of(context)
            self._style.load_state_dict(state)
            self._save(new=True)
            return pb.RestoreReply(version=self._style.version)

    def _own(self, context: grpc.ServicerContext) -> None:
        """Raise TurnError for a call of another training than that of the first Restore."""
        if not hmac.compare_digest(training_of(context), self._training):
            raise TurnError(
                "the service belongs to another training: start a service for each; one whose"
                " training is over, start anew, with another --state if it has one"
            )

    def _save(self, new: bool) -> None:
        """Write the journal; new: with the last rollout, which is still to be trained on."""
        if self._journal is None:
            return
        state = self._style.state_dict(replay=False)
        if not new:
            state["new"] = state["new"][:0]
        self._journal.save(state)

    def observe(self, server: Server) -> None:
        """Add version and replay size to the server's metrics."""
        style = self._style
        figures = {
            "style_version": ("Trainings so far.", lambda: style.version),
            "style_batches": ("Rollouts scored.", lambda: style.batches),
            "style_replay": ("Transitions in the replay.", lambda: style.replay.size),
        }
        for name, (what, value) in figures.items():
            Gauge(name, what, registry=server.registry).set_function(value)


def training_of(context: grpc.ServicerContext) -> str:
    """Digest of the id of the training that makes a call; empty without one. The id is the
    training's secret, which neither service nor journal keeps."""
    shown = dict(context.invocation_metadata() or ()).get(TRAINING, "")
    secret = shown if isinstance(shown, bytes) else shown.encode()
    return hashlib.sha256(secret).hexdigest() if secret else ""


def start(
    style: Discriminator, server_config: ServerConfig, journal: Journal | None = None
) -> Server:
    """Start a server of `style` at `server.address`; `server.drain()` ends it."""
    server = Server(server_config, ERRORS)
    service = StyleService(style, journal)
    style_pb2_grpc.add_StyleServicer_to_server(service, server.grpc)
    service.observe(server)
    server.start([NAME])
    return server
