"""Health check of a service."""

import time

import grpc
from grpc_health.v1 import health_pb2, health_pb2_grpc

from rpc.channel import Channel, ChannelConfig
from rpc.errors import RpcError


def check_health(config: ChannelConfig, service: str = "", timeout_s: float = 5.0) -> float:
    """Seconds that a healthy service takes to answer; one call without retries.

    service: full name (`rpc.v1.Style`); empty: the server as a whole.
    Raises RpcError where there is no answer or the answer is not SERVING.
    """
    channel = Channel(config, "service")
    began = time.monotonic()
    try:
        request = health_pb2.HealthCheckRequest(service=service)
        reply = health_pb2_grpc.HealthStub(channel.grpc).Check(request, timeout=timeout_s)
    except grpc.RpcError as error:
        code = error.code() if isinstance(error, grpc.Call) else None
        if code is grpc.StatusCode.NOT_FOUND:
            raise RpcError(f"{config.address} serves no {service}: is the address right?") from None
        raise RpcError(
            f"{config.address} does not answer ({code.name if code else error}):"
            " is it started, and does it want TLS (give its CA)?"
        ) from None
    finally:
        channel.close()
    if reply.status != health_pb2.HealthCheckResponse.SERVING:
        name = health_pb2.HealthCheckResponse.ServingStatus.Name(reply.status)
        raise RpcError(f"{config.address} answers {name}: it starts or drains")
    return time.monotonic() - began
