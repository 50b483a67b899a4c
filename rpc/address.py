"""Addresses of services: HOST:PORT or unix:PATH."""

import ipaddress

from rpc.errors import RpcError


def split_address(address: str) -> tuple[str, int]:
    """Host and port of HOST:PORT ([HOST]:PORT for IPv6); RpcError for any other text."""
    host, colon, port = address.rpartition(":")
    if not colon or not host or not port.isdecimal() or int(port) > 65535:
        raise RpcError(f"address '{address}': must be HOST:PORT with a port of 0..65535")
    return host.strip("[]"), int(port)


def is_local(address: str) -> bool:
    """Whether an address can be reached from this machine only."""
    if address.startswith("unix:"):
        return True
    host, _ = split_address(address)
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
