"""Small policies to serve, a server of them on a thread of its own, and poses to send."""

import asyncio
import contextlib
import hashlib
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import grpc
import numpy as np
import pytest
import torch

from policy.checkpoints.format import Layout, Manifest, read, write
from policy.checkpoints.reload import Source
from policy.checkpoints.served import Served
from policy.config import PolicyServiceConfig
from policy.model.acting import publish
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser
from policy.service.servicer import PolicyService, serving
from rpc.aio_server import AioServer
from rpc.server import ServerConfig
from rpc.v1 import policy_pb2 as pb
from rpc.v1 import policy_pb2_grpc
from tests.support.paths import ROOT
from world import tasks
from world.character import model as character
from world.character.features import STATE
from world.config import WorldConfig
from world.tasks.symmetry import symmetry

SIT = tasks.make("sit")
WIDTH = STATE.width + SIT.goal.width
NOTES = {"data": "none", "licence": "Apache-2.0"}


def layout(task: str = "sit") -> Layout:
    """Of a policy of the task."""
    goal = tasks.make(task).goal
    return Layout(
        task,
        tuple((f.name, f.width) for f in STATE),
        tuple((f.name, f.width) for f in goal),
        character.NU,
        (16,),
        skip=task == "carry",
    )


def weights(seed: int, task: str = "sit") -> dict[str, torch.Tensor]:
    """An actor whose actions are not all alike, and a normaliser that is not the identity."""
    width = STATE.width + tasks.make(task).goal.width
    torch.manual_seed(seed)
    actor = Actor(width, character.NU, (16,), layout(task).skip)
    torch.nn.init.normal_(actor.layers[-1].weight, std=0.3)  # pyright: ignore
    if actor.skip is not None:
        torch.nn.init.normal_(actor.skip.weight, std=0.05)
    normaliser = Normaliser(width)
    normaliser.update(torch.randn(500, width) * 2.0 + 0.5)
    return publish(actor, normaliser, symmetry(tasks.make(task)))


@cache
def make(seed: int = 0, name: str = "sit", task: str = "sit", sigma: float = 0.1) -> Served:
    """A policy with random weights."""
    digest = hashlib.sha256(f"{seed}{task}".encode()).hexdigest()
    manifest = Manifest(layout(task), seed, 1000 * seed, NOTES)
    return Served(name, weights(seed, task), manifest, WorldConfig(task=task), digest, sigma)


def save(path: Path, seed: int, task: str = "sit") -> Path:
    """A checkpoint of such a policy."""
    manifest = Manifest(layout(task), seed, 1000 * seed, NOTES)
    return write(path, {"policy": dict(weights(seed, task))}, manifest)


def load(path: Path) -> Served:
    """The policy of such a checkpoint."""
    found = read(path, ("policy",))
    file = (path / "policy.safetensors").read_bytes()
    digest = hashlib.sha256(file).hexdigest()
    return Served("sit", found.state["policy"], found.manifest, WorldConfig(), digest, 0.1)


def fixed(served: Served) -> Source:
    """A source that never changes; it points at a checkpoint, which must exist."""
    here = ROOT / "pretrained" / "sit"
    return Source(served.name, lambda: here, lambda _: served)


@dataclass
class Running:
    """A server on a thread of its own."""

    server: AioServer
    service: PolicyService
    loop: asyncio.AbstractEventLoop
    said: list[str]

    def now(self, call: Callable[[], object]) -> object:
        """The result of a call, made on the server's loop."""

        async def made() -> object:
            return call()

        return asyncio.run_coroutine_threadsafe(made(), self.loop).result(20)

    def stop(self) -> None:
        """Begin the drain, and do not wait for it."""
        with contextlib.suppress(RuntimeError):  # the loop has ended already
            self.loop.call_soon_threadsafe(self.server.stopping.set)


@contextmanager
def running(
    sources: list[Source],
    config: PolicyServiceConfig | None = None,
    server_config: ServerConfig | None = None,
) -> Iterator[Running]:
    """The service of these sources."""
    found: list[Running] = []
    started = threading.Event()
    failed: list[BaseException] = []
    said: list[str] = []

    async def main() -> None:
        async with serving(
            sources, server_config or ServerConfig(drain_s=1.0), config, said.append
        ) as (server, service):
            found.append(Running(server, service, asyncio.get_running_loop(), said))
            started.set()
            await server.stopping.wait()

    def thread() -> None:
        try:
            asyncio.run(main())
        except BaseException as error:
            failed.append(error)
        finally:
            started.set()

    one = threading.Thread(target=thread, daemon=True)
    one.start()
    started.wait(60)
    if failed:
        raise failed[0]
    try:
        yield found[0]
    finally:
        found[0].stop()
        one.join(30)
        assert not one.is_alive(), "the server did not stop"
    if failed:
        raise failed[0]


@contextmanager
def stub(
    running: Running, options: list[tuple[str, int]] | None = None
) -> Iterator[policy_pb2_grpc.PolicyStub]:
    """A client of it."""
    with grpc.insecure_channel(running.server.address, options) as channel:
        yield policy_pb2_grpc.PolicyStub(channel)


def observation(seed: int, rows: int = 1) -> tuple[bytes, bytes]:
    """Random states and goals."""
    draw = np.random.default_rng(seed)
    state = draw.standard_normal((rows, STATE.width)).astype("<f4")
    goal = draw.standard_normal((rows, SIT.goal.width)).astype("<f4")
    return state.tobytes(), goal.tobytes()


def pose(x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> pb.Pose:
    """A character that stands at rest."""
    qpos = character.standing_qpos()
    return pb.Pose(
        root_position=[x, y, qpos[2]],
        root_rotation=[np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)],
        root_velocity=[0.0, 0.0, 0.0],
        root_angular_velocity=[0.0, 0.0, 0.0],
        joint_position=qpos[7:].tolist(),
        joint_velocity=[0.0] * 28,
    )


def chair(x: float = 2.0, y: float = 0.0, yaw: float = 0.0) -> pb.Furniture:
    """A chair of the catalogue."""
    return pb.Furniture(
        piece="chair-test-000",
        position=[x, y, 0.0],
        rotation=[np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)],
    )


def renamed(served: Served, name: str) -> Served:
    """The same policy under another name."""
    return replace(served, name=name)


def refusal(call: object) -> tuple[grpc.StatusCode, str]:
    """Status and message of a call that must be refused."""
    with pytest.raises(grpc.RpcError) as caught:
        call() if callable(call) else list(call)  # pyright: ignore
    error = caught.value
    assert isinstance(error, grpc.Call)
    return error.code(), error.details() or ""


def numbers(data: bytes) -> np.ndarray:
    """Actions or targets [rows, 28] of a reply."""
    return np.frombuffer(data, "<f4").reshape(-1, character.NU)


def expected(seed: int, state: bytes, goal: bytes) -> np.ndarray:
    """The mean actions, by the networks as training has them."""
    policy = make(seed).policy
    rows = [torch.frombuffer(bytearray(part), dtype=torch.float32) for part in (state, goal)]
    return policy(rows[0].view(-1, STATE.width), rows[1].view(-1, SIT.goal.width)).numpy()


def act(client: policy_pb2_grpc.PolicyStub, **request: object) -> object:
    """A call of Act with one sound row, some fields of it replaced."""
    state, goal = observation(0)
    return lambda: client.Act(
        pb.ActRequest(**{"task": "sit", "state": state, "goal": goal} | request)
    )  # pyright: ignore
