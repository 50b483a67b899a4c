"""The discriminator at the other end of a wire: the same methods as `Discriminator`."""

from collections.abc import Callable, Mapping

import grpc
import numpy as np
import torch
from torch import Tensor

from discriminator.errors import StyleError, TurnError
from discriminator.messages import rollout_chunks, state_chunks, state_of
from discriminator.pairing import check_rollout
from discriminator.protocols import StyleScores
from rpc.channel import Channel, ChannelConfig, Metadata, Reply
from rpc.errors import CodecError, RefusedError
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc

TRAINING = "inhabit-training"
"""Key of a call's metadata: the id of the training that makes it."""
KINDS = {
    grpc.StatusCode.INVALID_ARGUMENT: StyleError,
    grpc.StatusCode.FAILED_PRECONDITION: TurnError,
}


class StyleClient:
    """Scores and trains over gRPC; waits while the service is away, never scores with zeros.

    Every call may be repeated, so that a retry changes nothing. A service that was killed and
    came back from its journal is sent the last rollout again where it needs it.
    """

    def __init__(
        self,
        config: ChannelConfig,
        report: Callable[[str], None] | None = None,
        half: bool = False,
        lost: Callable[[], str | None] | None = None,
        training: str = "",
    ) -> None:
        """Connect, waiting for the service if need be.

        report: gets one line when the service is away, and one when it is back.
        half: send states as float16.
        lost: why the service will never come back, None as long as it may.
        training: id that every call shows: from Restore on, the service takes no other's.
        Raises RpcError if the service cannot be reached.
        """
        metadata = [(TRAINING, training)] if training else []
        self._channel = Channel(config, "style service", report, lost, metadata)
        self._stub = style_pb2_grpc.StyleStub(self._channel.grpc)
        self._half = half
        self._last: list[pb.ScoreChunk] = []
        status = self.status()
        self.version, self.width = status.version, status.width
        self._lockstep = status.train_every == 0

    def score(
        self,
        batch: int,
        rollout_states: Tensor,
        end_index: Tensor,
        end_states: Tensor,
        valid: Tensor,
    ) -> StyleScores:
        """See `Discriminator.score`; also raises RpcError when the service stays away."""
        check_rollout(rollout_states, end_index, end_states, valid, self.width)
        expected = self.version if self._lockstep else None
        self._last = rollout_chunks(
            batch, expected, rollout_states, end_index, end_states, valid, self._half
        )
        reply = self._send(self._last)
        reward = np.frombuffer(reply.reward, "<f4").astype(np.float32)
        if reward.size != valid.numel():
            raise CodecError(f"reward: {reward.size} numbers, must be {valid.numel()}")
        reward = torch.from_numpy(reward).view(valid.shape)
        return StyleScores(reward, reply.version, dict(reply.metrics))

    def train(self, version: int) -> dict[str, float]:
        """See `Discriminator.train`; a service that trains by itself is left to it."""
        if not self._lockstep:
            return {}
        batch = self._last[0].header.batch if self._last else None
        request = pb.TrainRequest(version=version, batch=batch)

        def attempt(timeout_s: float, metadata: Metadata) -> pb.TrainReply:
            return self._stub.Train(request, timeout=timeout_s, metadata=metadata)

        try:
            reply = self._call(attempt)
        except TurnError:
            # Killed since the last rollout was scored, and back from before it?
            if not self._last or self.status().version != version:
                raise
            self._send(self._last)
            reply = self._call(attempt)
        self.version = reply.version
        return dict(reply.metrics)

    def status(self) -> pb.StatusReply:
        """Version, counts and configuration of the service."""
        return self._call(
            lambda timeout_s, metadata: self._stub.Status(
                pb.StatusRequest(), timeout=timeout_s, metadata=metadata
            )
        )

    def state_dict(self) -> dict[str, Tensor]:
        """The service's whole state."""
        return self._call(
            lambda timeout_s, metadata: state_of(
                self._stub.Checkpoint(pb.CheckpointRequest(), timeout=timeout_s, metadata=metadata)
            )
        )

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Make the service the discriminator of `state`; StyleError if it does not fit."""
        reply = self._call(
            lambda timeout_s, metadata: self._stub.Restore(
                state_chunks(state), timeout=timeout_s, metadata=metadata
            )
        )
        self.version = reply.version
        self._last = []

    def close(self) -> None:
        """Let go of the connection; the service lives on."""
        self._channel.close()

    def _send(self, chunks: list[pb.ScoreChunk]) -> pb.ScoreReply:
        return self._call(
            lambda timeout_s, metadata: self._stub.Score(
                iter(chunks), timeout=timeout_s, metadata=metadata
            )
        )

    def _call(self, attempt: Callable[[float, Metadata], Reply]) -> Reply:
        try:
            return self._channel.call(attempt)
        except RefusedError as error:
            if error.code in KINDS:
                raise KINDS[error.code](str(error)) from error
            raise
