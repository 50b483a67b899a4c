"""Addresses of services: HOST:PORT or unix:PATH."""

import ipaddress

from rpc.errors import SettingsError


def split_address(address: str) -> tuple[str, int]:
    """Host and port of HOST:PORT ([HOST]:PORT for IPv6); SettingsError for any other text."""
    host, colon, port = address.rpartition(":")
    if not colon or not host or not port.isdecimal() or int(port) > 65535:
        raise SettingsError(f"address '{address}': must be HOST:PORT with a port of 0..65535")
    if host.startswith("[") and host.endswith("]"):
        return host[1:-1], int(port)
    if ":" in host or "[" in host or "]" in host:
        raise SettingsError(f"address '{address}': write IPv6 in brackets, as [::1]:{port}")
    return host, int(port)


def joined(host: str, port: int) -> str:
    """HOST:PORT, with brackets around IPv6."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def is_loopback(host: str) -> bool:
    """Whether a host name or address can be reached from this machine only."""
    if host == "localhost":
        return True
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return False
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return (mapped or address).is_loopback


def is_local(address: str) -> bool:
    """Whether an address can be reached from this machine only."""
    return address.startswith("unix:") or is_loopback(split_address(address)[0])
