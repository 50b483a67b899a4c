"""Client of the discriminator service, with the methods of `Discriminator`."""

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

#: Of the settings in a status: the mean of the mocap by which the discriminator normalises.
MOCAP_MEAN = "mocap_mean"
TRAINING = "inhabit-training"
"""Metadata key of a call: the id of the calling training."""
ERRORS = {
    grpc.StatusCode.INVALID_ARGUMENT: StyleError,
    grpc.StatusCode.FAILED_PRECONDITION: TurnError,
}


class StyleClient:
    """Scores and trains over gRPC.

    While the service is unreachable, calls wait; rewards are never replaced by zeros. Every call is
    idempotent, so that it can be retried. A service that restarts from its journal gets the last
    rollout again if it needs it.
    """

    def __init__(
        self,
        config: ChannelConfig,
        report: Callable[[str], None] | None = None,
        half: bool = False,
        lost: Callable[[], str | None] | None = None,
        training: str = "",
    ) -> None:
        """Connect, and wait for the service if necessary.

        report: called with one line when the service is unreachable, and one when it is back.
        half: send states as float16.
        lost: returns why the service cannot come back, else None.
        training: id in the metadata of every call, a secret of the training; after its Restore the
        service refuses other ids.
        Raises RpcError if the service cannot be reached.
        """
        metadata = [(TRAINING, training)] if training else []
        self._channel = Channel(config, "style service", report, lost, metadata)
        self._stub = style_pb2_grpc.StyleStub(self._channel.grpc)
        self._half = half
        self._last: list[pb.ScoreChunk] = []
        status = self.status()
        self.version, self.width = status.version, status.width

    def score(
        self,
        batch: int,
        rollout_states: Tensor,
        end_index: Tensor,
        end_states: Tensor,
        valid: Tensor,
    ) -> StyleScores:
        """See `Discriminator.score`; also raises RpcError if the service stays unreachable."""
        check_rollout(rollout_states, end_index, end_states, valid, self.width)
        self._last = rollout_chunks(
            batch, self.version, rollout_states, end_index, end_states, valid, self._half
        )
        reply = self._send(self._last)
        reward = np.frombuffer(reply.reward, "<f4").astype(np.float32)
        if reward.size != valid.numel():
            raise CodecError(f"reward: {reward.size} numbers, must be {valid.numel()}")
        reward = torch.from_numpy(reward).view(valid.shape)
        return StyleScores(reward, reply.version, dict(reply.metrics))

    def train(self, version: int) -> dict[str, float]:
        """See `Discriminator.train`."""
        batch = self._last[0].header.batch if self._last else None
        request = pb.TrainRequest(version=version, batch=batch)

        def attempt(timeout_s: float, metadata: Metadata) -> pb.TrainReply:
            return self._stub.Train(request, timeout=timeout_s, metadata=metadata)

        try:
            reply = self._call(attempt)
        except TurnError:
            # The service may have been killed after the last score, and restarted from before it.
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
        """Complete state of the service."""
        return self._call(
            lambda timeout_s, metadata: state_of(
                self._stub.Checkpoint(pb.CheckpointRequest(), timeout=timeout_s, metadata=metadata)
            )
        )

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Load a state into the service; StyleError if it does not fit."""
        reply = self._call(
            lambda timeout_s, metadata: self._stub.Restore(
                state_chunks(state), timeout=timeout_s, metadata=metadata
            )
        )
        self.version = reply.version
        self._last = []

    def close(self) -> None:
        """Close the connection; the service goes on."""
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
            if error.code in ERRORS:
                raise ERRORS[error.code](str(error)) from error
            raise
