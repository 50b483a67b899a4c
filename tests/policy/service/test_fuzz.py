"""Ten thousand messages that nobody meant: every call answers or refuses, and the server lives."""

import gc
import random
from collections.abc import Iterator
from pathlib import Path

import grpc
import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from policy.config import BatchConfig, PolicyServiceConfig, SynthesisConfig
from rpc.v1 import policy_pb2 as pb
from rpc.v1 import policy_pb2_grpc
from tests.support.policy_cases import Running, chair, fixed, make, observation, pose, running

MESSAGES = 10_000
#: Per example: streams of so many frames, and calls.
STREAMS, FRAMES, CALLS = 3, 40, 14
EXAMPLES = 110
ALLOWED = {
    grpc.StatusCode.OK,
    grpc.StatusCode.INVALID_ARGUMENT,
    grpc.StatusCode.NOT_FOUND,
    grpc.StatusCode.RESOURCE_EXHAUSTED,
}
_NUMBERS = st.one_of(
    st.floats(width=32, allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, 1.0, -1.0, 1e-30, 3e38]),
)
_TASKS = st.sampled_from(["", "sit", "sit", "sit", "dance", "\0", "s" * 300])


@pytest.fixture(scope="module")
def server() -> Iterator[Running]:
    config = PolicyServiceConfig(
        batch=BatchConfig(max_wait_s=1e-4), synthesis=SynthesisConfig(max_s=0.2)
    )
    with running([fixed(make())], config) as found:
        yield found


class Mutator:
    """Valid messages, spoilt in ways that hypothesis chooses."""

    def __init__(self, choice: random.Random, number: float, junk: bytes, task: str) -> None:
        self.choice, self.number, self.junk, self.task = choice, number, junk, task

    def data(self, data: bytes) -> bytes:
        """Bytes as they are, cut, lengthened, replaced, or with one number overwritten."""
        how = self.choice.randrange(6) if len(data) >= 4 else 2
        if how == 0:
            return data[: self.choice.randrange(len(data) + 1)]
        if how == 1:
            return data + self.junk
        if how == 2:
            return self.junk
        if how == 3:
            array = np.frombuffer(bytearray(data[: len(data) // 4 * 4]), "<f4")
            array[self.choice.randrange(len(array))] = self.number
            return array.tobytes()
        return data

    def message(self, message: object) -> None:
        """Spoil a few fields, at any depth."""
        for _ in range(self.choice.randrange(3)):
            self._field(message)

    def _field(self, message: object) -> None:
        fields = message.DESCRIPTOR.fields  # pyright: ignore
        field = self.choice.choice(fields)
        if field.message_type is not None:
            if field.is_repeated:
                items = getattr(message, field.name)
                if items and self.choice.random() < 0.7:
                    self._field(self.choice.choice(items))
                elif len(items) < 4:
                    self._field(items.add())
            elif self.choice.random() < 0.1:
                message.ClearField(field.name)  # pyright: ignore
            else:
                self._field(getattr(message, field.name))
            return
        if self.choice.random() < 0.2:
            message.ClearField(field.name)  # pyright: ignore
            return
        value = self._value(field)
        if not field.is_repeated:
            setattr(message, field.name, value)
            return
        values = getattr(message, field.name)
        if values and self.choice.random() < 0.7:
            values[self.choice.randrange(len(values))] = value
        elif len(values) < 64:
            values.append(value)

    def _value(self, field: object) -> object:
        kind = field.cpp_type  # pyright: ignore
        if kind in (field.CPPTYPE_FLOAT, field.CPPTYPE_DOUBLE):  # pyright: ignore
            return self.number
        if kind == field.CPPTYPE_BOOL:  # pyright: ignore
            return True
        if kind == field.CPPTYPE_STRING:  # pyright: ignore
            names = [self.task, "chair-test-001", "bed-test-000", "pelvis", "x"]
            return self.junk if field.type == field.TYPE_BYTES else self.choice.choice(names)  # pyright: ignore
        return self.choice.choice([0, 1, 7, 2**31 - 1])


def call(
    client: policy_pb2_grpc.PolicyStub, mutate: Mutator, number: int
) -> tuple[grpc.StatusCode, int]:
    """One message; its status, and 1."""
    state, goal = observation(number % 7)
    if number == 0:
        found = client.Describe.future(pb.DescribeRequest(task=mutate.task), timeout=20)
    elif number == 1:
        request = pb.SynthesizeRequest(
            task=mutate.task, furniture=chair(), seconds=0.1, start=pb.Start(pose=pose()),
            pushes=[pb.Push(at_s=0.0, seconds=0.1, body="torso", force=[1.0, 0.0, 0.0])],
            projectiles=pb.Projectiles(seed=number, count=2, mass_kg=1.0, radius_m=0.1),
        )  # fmt: skip
        if mutate.choice.random() < 0.5:
            request.moves.add(at_s=0.05, position=[1.0, 0.0, 0.0], rotation=[1.0, 0.0, 0.0, 0.0])
        else:
            request.displacement.CopyFrom(pb.Displacement(seed=1, near_m=9.0, shift_m=0.5))
        mutate.message(request)
        return streamed(client.Synthesize(request, timeout=20))[0], 1
    elif number < 7:
        posed = pb.ActFromPoseRequest(
            task=mutate.task, situations=[pb.Situation(pose=pose(), furniture=chair())]
        )
        mutate.message(posed)
        found = client.ActFromPose.future(posed, timeout=20)
    else:
        asked = pb.ActRequest(task=mutate.task, state=mutate.data(state), goal=mutate.data(goal))
        found = client.Act.future(asked, timeout=20)
    return found.code(), 1


def stream(client: policy_pb2_grpc.PolicyStub, mutate: Mutator) -> tuple[grpc.StatusCode, int]:
    """A stream of frames of which the last, and hardly any other, is spoilt; status and frames."""
    frames, task = [], mutate.task if mutate.choice.random() < 0.1 else "sit"
    for sequence in range(FRAMES):
        frame = pb.ControlRequest(task=task, sequence=sequence)
        if mutate.choice.random() < 0.15:
            frame.situation.CopyFrom(pb.Situation(pose=pose(), furniture=chair()))
        else:
            state, goal = observation(sequence % 7)
            frame.observation.CopyFrom(pb.Observation(state=state, goal=goal))
        if sequence == FRAMES - 1 or mutate.choice.random() < 0.003:
            mutate.message(frame)
            if frame.WhichOneof("input") == "observation":
                frame.observation.state = mutate.data(frame.observation.state)
        frames.append(frame)
    return streamed(client.Control(iter(frames), timeout=20))


def streamed(call: object) -> tuple[grpc.StatusCode, int]:
    """The status of a stream, read to its end, and the messages that were looked at."""
    replies = 0
    try:
        for reply in call:  # pyright: ignore
            replies += 1
            if isinstance(reply, pb.ControlReply):
                assert np.isfinite(np.frombuffer(reply.target, "<f4")).all()
    except grpc.RpcError:
        replies += 1
    return call.code(), replies  # pyright: ignore


def resident_mb() -> float:
    """Of this process, which holds the server."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    return 0.0


# thirteen seconds of processor time, which a busy machine may take minutes to give
@pytest.mark.timeout(1200)
def test_ten_thousand_messages_neither_crash_nor_leak(server: Running) -> None:
    seen: dict[grpc.StatusCode, int] = {}
    counts: dict[str, int] = {}
    memory: list[float] = []
    with grpc.insecure_channel(server.server.address) as channel:
        client = policy_pb2_grpc.PolicyStub(channel)

        @settings(
            max_examples=EXAMPLES,
            deadline=None,
            database=None,
            derandomize=True,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(
            st.randoms(use_true_random=False, note_method_calls=False).map(lambda r: r.random()),
            _NUMBERS,
            st.binary(max_size=64),
            _TASKS,
        )
        def send(seed: float, number: float, junk: bytes, task: str) -> None:
            mutate = Mutator(random.Random(seed), number, junk, task)
            for k in range(STREAMS + CALLS):
                sent = call(client, mutate, k) if k < CALLS else stream(client, mutate)
                code, messages = sent
                counts["messages"] = counts.get("messages", 0) + messages
                seen[code] = seen.get(code, 0) + 1
                assert code in ALLOWED, code
            gc.collect(0)
            memory.append(resident_mb())

        send()
        assert counts["messages"] >= MESSAGES, counts
        calls = sum(seen.values())
        assert seen[grpc.StatusCode.OK] > calls / 20, seen
        assert seen[grpc.StatusCode.INVALID_ARGUMENT] > calls / 10, seen
        # flat once everything that is kept on purpose is there
        half = len(memory) // 2
        assert max(memory[-5:]) < 1.05 * min(memory[half : half + 5]), memory
        # and it still serves
        state, goal = observation(0)
        assert client.Act(pb.ActRequest(task="sit", state=state, goal=goal)).action
    assert not server.now(lambda: len(server.service.streams) + len(server.service.syntheses))
    assert not server.now(lambda: server.service.batchers["sit"].queued_rows)


def test_bytes_that_are_no_messages_are_refused(server: Running) -> None:
    with grpc.insecure_channel(server.server.address) as channel:
        for method in ("Act", "ActFromPose", "Describe"):
            call = channel.unary_unary(f"/rpc.v1.Policy/{method}")
            for junk in (b"\xff" * 9, b"\x0a\xff\xff\xff\xff\x0f", b"\x08"):
                with pytest.raises(grpc.RpcError, match="cannot be parsed") as caught:
                    call(junk, timeout=10)
                assert caught.value.code() is grpc.StatusCode.INVALID_ARGUMENT  # pyright: ignore
        for method in ("Control", "Synthesize"):
            stream = channel.stream_stream(f"/rpc.v1.Policy/{method}")
            with pytest.raises(grpc.RpcError, match="cannot be parsed") as caught:
                list(stream(iter([b"\xff" * 9]), timeout=10))
            assert caught.value.code() is grpc.StatusCode.INVALID_ARGUMENT  # pyright: ignore
        assert policy_pb2_grpc.PolicyStub(channel).Describe(pb.DescribeRequest()).policies
