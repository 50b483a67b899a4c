"""A service with one call of each outcome, its server and a call of it."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import grpc

from rpc.channel import Channel, ChannelConfig
from rpc.errors import CodecError
from rpc.server import Server, ServerConfig
from rpc.v1 import style_pb2 as pb
from rpc.v1 import style_pb2_grpc

NAME = "rpc.v1.Style"


class Answers(style_pb2_grpc.StyleServicer):
    """A service with one call of each outcome."""

    def __init__(self) -> None:
        self.entered = threading.Event()

    def Status(self, request: pb.StatusRequest, context: grpc.ServicerContext) -> pb.StatusReply:
        return pb.StatusReply(version=7)

    def Train(self, request: pb.TrainRequest, context: grpc.ServicerContext) -> pb.TrainReply:
        if request.version == 0:
            raise CodecError("version: 0, must be 1 or more")
        if request.version == 1:
            raise KeyError("unexpected")
        self.entered.set()
        time.sleep(0.5)
        return pb.TrainReply(version=request.version)


@contextmanager
def serving(config: ServerConfig) -> Iterator[tuple[Server, Answers]]:
    server, answers = Server(config), Answers()
    style_pb2_grpc.add_StyleServicer_to_server(answers, server.grpc)
    server.start([NAME])
    try:
        yield server, answers
    finally:
        server.drain()


def status(config: ChannelConfig) -> int:
    channel = Channel(config, "service")
    stub = style_pb2_grpc.StyleStub(channel.grpc)
    try:
        return channel.call(
            lambda timeout, metadata: stub.Status(
                pb.StatusRequest(), timeout=timeout, metadata=metadata
            )
        ).version
    finally:
        channel.close()
