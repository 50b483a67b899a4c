"""HOST:PORT of pages that are served on this machine, and whether only this machine reaches it."""

import ipaddress

from world.errors import ConfigError


def address_of(listen: str) -> tuple[str, int]:
    """Host and port of HOST:PORT; ConfigError for anything else."""
    host, _, port = listen.rpartition(":")
    if not host or not port.isdecimal() or int(port) > 65535:
        raise ConfigError(f"cannot listen on '{listen}': must be HOST:PORT, as 127.0.0.1:8080")
    return host.strip("[]"), int(port)


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a host's name or address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
