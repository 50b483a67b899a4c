"""HOST:PORT of pages that are served on this machine, and whether only this machine reaches it."""

import socket

from rpc.address import is_loopback, joined, split_address
from rpc.errors import RpcError
from world.errors import ConfigError

__all__ = ["address_of", "family", "is_loopback", "joined"]


def address_of(listen: str) -> tuple[str, int]:
    """Return host and port of HOST:PORT, [HOST]:PORT for IPv6; ConfigError for anything else."""
    try:
        return split_address(listen)
    except RpcError as error:
        why = str(error).partition(": ")[2]
        raise ConfigError(
            f"cannot listen on '{listen}': {why}, as 127.0.0.1:8080 or [::1]:8080"
            if "HOST:PORT" in why
            else f"cannot listen on '{listen}': {why}"
        ) from None


def family(host: str) -> socket.AddressFamily:
    """Return the family of sockets of a host name or address."""
    return socket.AF_INET6 if ":" in host else socket.AF_INET
