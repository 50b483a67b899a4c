"""Connections to a policy service, and its calls with arrays in place of bytes."""

import ipaddress
from collections.abc import Iterator, Sequence
from pathlib import Path

import grpc
import numpy as np
from numpy.typing import ArrayLike

from inhabit_client.closing import Closing
from inhabit_client.control import Actions, Session, actions
from inhabit_client.errors import told
from inhabit_client.motion import Frame, Motion, frame_of
from inhabit_client.v1 import policy_pb2 as pb
from inhabit_client.v1 import policy_pb2_grpc as stubs

#: A proxy of the environment (http_proxy) reaches neither this machine nor the service.
_OPTIONS = [
    ("grpc.enable_http_proxy", 0),
    ("grpc.max_receive_message_length", 64 << 20),
    # a stream has no deadline: a connection that loses all packets ends after the sum of these two
    ("grpc.keepalive_time_ms", 10_000),
    ("grpc.keepalive_timeout_ms", 5_000),
    ("grpc.http2.ping_timeout_ms", 5_000),
    ("grpc.http2.max_pings_without_data", 0),  # any number
]


class Client(Closing):
    """A connection to a policy service; `with` closes it. Calls raise ServiceError."""

    def __init__(self, channel: grpc.Channel, deadline_s: float) -> None:
        self._channel, self._deadline_s = channel, deadline_s
        self._stub = stubs.PolicyStub(channel)
        self._described: pb.DescribeReply | None = None

    def describe(self, policy: str = "") -> pb.DescribeReply:
        """Return features, actions, limits and origin of a policy, or of all."""
        with told():
            return self._stub.Describe(pb.DescribeRequest(task=policy), timeout=self._deadline_s)

    def policies(self) -> tuple[pb.PolicyDescription, ...]:
        """Return the served policies: name, task, version, features, training data, licence."""
        return tuple(self.describe().policies)

    def joints(self) -> tuple[pb.Joint, ...]:
        """Return the character's joints, in the order of poses."""
        if self._described is None:
            self._described = self.describe()
        return tuple(self._described.joints)

    def act(
        self, policy: str, state: ArrayLike, goal: ArrayLike, seed: int | None = None
    ) -> Actions:
        """Return actions of states [n, state width] and goals [n, goal width].

        seed: of sampled actions; None: the mean actions. Raises ValueError for arrays of other
        shapes.
        """
        rows = [np.ascontiguousarray(part, "<f4") for part in (state, goal)]
        if rows[0].ndim != 2 or rows[1].ndim != 2 or len(rows[0]) != len(rows[1]):
            shapes = " and ".join(str(list(part.shape)) for part in rows)
            raise ValueError(f"state and goal: must be [n, width] with one n, are {shapes}")
        request = pb.ActRequest(
            task=policy, state=rows[0].tobytes(), goal=rows[1].tobytes(), seed=seed
        )
        with told():
            reply: pb.ActReply = self._stub.Act(request, timeout=self._deadline_s)
        return actions(reply.action, reply.target, reply.version, len(rows[0]))

    def act_from_poses(
        self, policy: str, situations: Sequence[pb.Situation], seed: int | None = None
    ) -> Actions:
        """Return actions of situations, of which the service computes states and goals."""
        request = pb.ActFromPoseRequest(task=policy, situations=situations, seed=seed)
        with told():
            reply: pb.ActReply = self._stub.ActFromPose(request, timeout=self._deadline_s)
        return actions(reply.action, reply.target, reply.version, len(situations))

    def control(self, policy: str, seed: int | None = None) -> Session:
        """Return an open stream that controls one character."""
        return Session(self._stub, policy, seed, self._deadline_s)

    def stream(self, request: pb.SynthesizeRequest) -> Iterator[pb.SynthesizeReply]:
        """Yield the messages of a motion: a header, the frames as they are computed, a summary."""
        call = self._stub.Synthesize(request)
        try:
            with told():
                yield from call
        finally:
            # who stops to listen does not leave the service simulating
            call.cancel()

    def frames(self, request: pb.SynthesizeRequest) -> Iterator[Frame]:
        """Yield the frames of a motion as they are computed."""
        header = pb.SynthesisHeader()
        for reply in self.stream(request):
            if reply.HasField("header"):
                header = reply.header
            elif reply.HasField("frame"):
                yield frame_of(reply.frame, header)

    def synthesize(
        self,
        policy: str,
        thing: pb.Furniture | pb.CarriedBox | None = None,
        start: Sequence[float] = (0.0, 0.0, 0.0),
        seconds: float | None = None,
        seed: int | None = None,
    ) -> Motion:
        """Return a whole motion of a character that stands at `start` (x, y, m; yaw, rad).

        thing: furniture, or the box to carry. For pushes, moves and balls: `motion` of a request.
        """
        request = pb.SynthesizeRequest(task=policy, seconds=seconds, seed=seed)
        if isinstance(thing, pb.Furniture):
            request.furniture.CopyFrom(thing)
        elif thing is not None:
            request.box.CopyFrom(thing)
        x, y, yaw = start
        request.start.standing.CopyFrom(pb.Stance(x=x, y=y, yaw_rad=yaw))
        return self.motion(request)

    def motion(self, request: pb.SynthesizeRequest) -> Motion:
        """Return the whole motion of a request."""
        header, summary, frames = pb.SynthesisHeader(), pb.SynthesisSummary(), []
        for reply in self.stream(request):
            if reply.HasField("header"):
                header = reply.header
            elif reply.HasField("frame"):
                frames.append(frame_of(reply.frame, header))
            else:
                summary = reply.summary
        return Motion(header, summary, tuple(frames))

    def close(self) -> None:
        """Close the connection."""
        self._channel.close()


def connect(
    address: str = "127.0.0.1:50051",
    *,
    tls_ca: Path | None = None,
    tls_cert: Path | None = None,
    tls_key: Path | None = None,
    token: str = "",
    tls: bool = False,
    deadline_s: float = 60.0,
) -> Client:
    """Return a connection to a service; it is made at the first call.

    tls_ca: trusted certificates (PEM); it implies TLS, as does `tls`, with the system's.
    tls_cert, tls_key: of this client, for mutual TLS. token: the service's bearer token, which is
    sent to another machine by TLS alone. deadline_s: longest time of a call that is no stream, and
    of a step of one that controls, s. A stream ends within 15 s of losing its connection.
    Raises ValueError for a token without TLS, OSError for files that cannot be read.
    """
    secure = tls or tls_ca is not None or tls_cert is not None
    if token and not secure and not is_local(address):
        raise ValueError(f"{address}: a token goes to another machine by TLS alone: give tls_ca")
    if secure:
        parts = [None if p is None else p.read_bytes() for p in (tls_ca, tls_key, tls_cert)]
        channel = grpc.secure_channel(address, grpc.ssl_channel_credentials(*parts), _OPTIONS)
    else:
        channel = grpc.insecure_channel(address, _OPTIONS)
    if token:
        channel = grpc.intercept_channel(channel, _Bearer(token))
    return Client(channel, deadline_s)


def is_local(address: str) -> bool:
    """Return whether an address, HOST:PORT or unix:PATH, is on this machine."""
    if address.startswith("unix:"):
        return True
    host = address.rpartition(":")[0].strip("[]")
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class _Bearer(
    grpc.UnaryUnaryClientInterceptor,
    grpc.UnaryStreamClientInterceptor,
    grpc.StreamStreamClientInterceptor,
):
    """Adds the token to every call."""

    def __init__(self, token: str) -> None:
        self._pair = ("authorization", f"Bearer {token}")

    def intercept_unary_unary(self, continuation, client_call_details, request):  # pyright: ignore
        return continuation(self._with(client_call_details), request)

    def intercept_unary_stream(self, continuation, client_call_details, request):  # pyright: ignore
        return continuation(self._with(client_call_details), request)

    def intercept_stream_stream(  # pyright: ignore
        self, continuation, client_call_details, request_iterator
    ):
        return continuation(self._with(client_call_details), request_iterator)

    def _with(self, details: grpc.ClientCallDetails) -> "_Details":
        return _Details(details, (*(details.metadata or ()), self._pair))


class _Details(grpc.ClientCallDetails):
    """Details of a call with other metadata."""

    def __init__(
        self, details: grpc.ClientCallDetails, metadata: Sequence[tuple[str, str | bytes]]
    ):
        self.method, self.timeout = details.method, details.timeout
        self.credentials, self.wait_for_ready = details.credentials, details.wait_for_ready
        self.compression, self.metadata = details.compression, metadata
