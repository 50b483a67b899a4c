"""The servers that `inhabit bench serve` compares, each in a process of its own on one core.

`python -m console.bench.serve_servers KIND FOLDER` prints one JSON line {"address": ...} when it
serves, answers every line of standard input with the processor seconds spent so far, and ends with
its standard input.
"""

import contextlib
import json
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import grpc

from actors.cluster import ray_session
from console.run.machine import process_tree
from console.serving import loading
from policy.service.servicer import serve
from rpc.aio_server import AioServer, run
from rpc.server import ServerConfig
from rpc.v1 import policy_pb2 as pb
from rpc.v1 import policy_pb2_grpc

SERVER_CORE = 0


class Echo(policy_pb2_grpc.PolicyServicer):
    """Answers with as many bytes as the policy does, and does nothing else."""

    def __init__(self, actions: int) -> None:
        self._row = bytes(4 * actions)

    async def Act(self, request: pb.ActRequest, context: Any) -> pb.ActReply:
        """As many bytes as an action of one row has."""
        return pb.ActReply(action=self._row, target=self._row, version="0-00000000")

    async def Control(self, request_iterator: Any, context: Any) -> None:
        """The same, frame after frame."""
        while (request := await context.read()) is not grpc.aio.EOF:
            await context.write(
                pb.ControlReply(
                    sequence=request.sequence,
                    action=self._row,
                    target=self._row,
                    version="0-00000000",
                )
            )


def policy(folder: Path) -> None:
    """Our own service."""
    source = loading.source("sit", folder, "latest")
    run(
        serve([source], ServerConfig(), started=lambda server, _: _ready(server, time.process_time))
    )


def echo(folder: Path) -> None:
    """gRPC itself: no interceptors, no policy."""
    actions = loading.served("sit", folder).action_map.offset.numel()

    async def main() -> None:
        server = grpc.aio.server(options=[("grpc.so_reuseport", 0)])
        policy_pb2_grpc.add_PolicyServicer_to_server(Echo(actions), server)
        port = server.add_insecure_port("127.0.0.1:0")
        await server.start()
        _ready(f"127.0.0.1:{port}", time.process_time)
        await server.wait_for_termination()

    run(main())


def ray_serve(folder: Path) -> None:
    """The same policy behind Ray Serve's gRPC ingress, with Ray Serve's own batching."""
    import numpy as np
    import torch
    from ray import serve as ray_serve
    from ray.serve.config import gRPCOptions

    @ray_serve.deployment(max_ongoing_requests=4096)
    class Deployed:
        def __init__(self) -> None:
            torch.set_num_threads(1)
            self.served = loading.served("sit", folder).check()

        @ray_serve.batch(max_batch_size=256, batch_wait_timeout_s=0.001)
        async def act(self, rows: list[bytes]) -> list[tuple[bytes, bytes]]:
            data = bytearray().join(rows)
            states = torch.from_numpy(np.frombuffer(data, "<f4").reshape(len(rows), -1))
            action = self.served.act(states)
            target = self.served.action_map.set_points(action)
            pairs = zip(action.numpy(), target.numpy(), strict=True)
            return [(a.tobytes(), t.tobytes()) for a, t in pairs]

        async def Act(self, request: pb.ActRequest) -> pb.ActReply:
            action, target = await self.act(request.state + request.goal)
            return pb.ActReply(action=action, target=target, version=self.served.version)

    import socket

    with socket.create_server(("127.0.0.1", 0)) as one, socket.create_server(("", 0)) as other:
        port, http_port = one.getsockname()[1], other.getsockname()[1]
    with ray_session(cpus=4):
        ray_serve.start(
            http_options={"host": "127.0.0.1", "port": http_port},  # the proxy serves gRPC, too
            grpc_options=gRPCOptions(
                port=port,
                grpc_servicer_functions=["rpc.v1.policy_pb2_grpc.add_PolicyServicer_to_server"],
            ),
        )
        ray_serve.run(Deployed.bind(), name="sit", route_prefix="/")
        with grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
            grpc.channel_ready_future(channel).result(120)
        pin(process_tree())
        _ready(f"127.0.0.1:{port}", _family_seconds)
        threading.Event().wait()


def pin(processes: set[int]) -> None:
    """Keep all threads of these processes, and what they start from now on, on one core."""
    for pid in processes:
        for thread in Path(f"/proc/{pid}/task").glob("[0-9]*"):
            with contextlib.suppress(OSError):  # it has ended
                os.sched_setaffinity(int(thread.name), {SERVER_CORE})


def _family_seconds() -> float:
    """Processor seconds of all processes of this session: Ray is many."""
    ticks = 0
    for pid in process_tree():
        try:
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def _ready(server: AioServer | str, spent: Callable[[], float]) -> None:
    """Say where it serves, and answer questions about the processor's time from then on."""
    address = server if isinstance(server, str) else server.address
    print(json.dumps({"address": address}), flush=True)

    def answer() -> None:
        for _ in sys.stdin:
            print(json.dumps({"processor_s": spent()}), flush=True)
        os._exit(0)

    threading.Thread(target=answer, daemon=True).start()


SERVERS = {"policy": policy, "echo": echo, "ray": ray_serve}

if __name__ == "__main__":
    if sys.argv[1] != "ray":  # its processes would miss each other's deadlines while they start
        pin({os.getpid()})
    SERVERS[sys.argv[1]](Path(sys.argv[2]))
