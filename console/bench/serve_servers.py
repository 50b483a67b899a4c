"""The server processes of `inhabit bench serve`, each on one core.

`python -m console.bench.serve_servers KIND FOLDER` prints one JSON line {"address": ...} when it
serves, answers every line of standard input with its processor seconds so far, and ends with its
standard input.
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
from console.run.machine import process_tree, process_tree_seconds
from console.serving import loading
from policy.service.servicer import serve
from rpc.aio_server import AioServer, run
from rpc.server import ServerConfig
from rpc.v1 import policy_pb2 as pb
from rpc.v1 import policy_pb2_grpc

SERVER_CORE = 0


class Echo(policy_pb2_grpc.PolicyServicer):
    """A servicer that replies with as many bytes as a policy, without computing."""

    def __init__(self, actions: int) -> None:
        self._row = bytes(4 * actions)

    async def Act(self, request: pb.ActRequest, context: Any) -> pb.ActReply:
        """Reply with the bytes of one action."""
        return pb.ActReply(action=self._row, target=self._row, version="0-00000000")

    async def Control(self, request_iterator: Any, context: Any) -> None:
        """Reply with the bytes of one action per request."""
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
    """Serve by the policy service."""
    source = loading.source("sit", folder, "latest")
    run(
        serve([source], ServerConfig(), started=lambda server, _: _ready(server, time.process_time))
    )


def echo(folder: Path) -> None:
    """Serve by a gRPC echo, without interceptors and policy."""
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
    """Serve the same policy by Ray Serve's gRPC ingress and batching."""
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
            http_options={"host": "127.0.0.1", "port": http_port},  # required by the proxy
            grpc_options=gRPCOptions(
                port=port,
                grpc_servicer_functions=["rpc.v1.policy_pb2_grpc.add_PolicyServicer_to_server"],
            ),
        )
        ray_serve.run(Deployed.bind(), name="sit", route_prefix="/")
        with grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
            grpc.channel_ready_future(channel).result(120)
        pin(process_tree())
        _ready(f"127.0.0.1:{port}", process_tree_seconds)
        threading.Event().wait()


def pin(processes: set[int]) -> None:
    """Pin all threads of these processes, and their later children, to one core."""
    for pid in processes:
        for thread in Path(f"/proc/{pid}/task").glob("[0-9]*"):
            with contextlib.suppress(OSError):  # the thread has ended
                os.sched_setaffinity(int(thread.name), {SERVER_CORE})


def _ready(server: AioServer | str, spent: Callable[[], float]) -> None:
    """Print the address, then answer each line of standard input with the processor time."""
    address = server if isinstance(server, str) else server.address
    print(json.dumps({"address": address}), flush=True)

    def answer() -> None:
        for _ in sys.stdin:
            print(json.dumps({"processor_s": spent()}), flush=True)
        os._exit(0)

    threading.Thread(target=answer, daemon=True).start()


SERVERS = {"policy": policy, "echo": echo, "ray": ray_serve}

if __name__ == "__main__":
    if sys.argv[1] != "ray":  # on one core Ray's processes miss deadlines while they start
        pin({os.getpid()})
    SERVERS[sys.argv[1]](Path(sys.argv[2]))
