"""HOST:PORT of pages that are served on this machine, and whether only this machine reaches it;
settings of services and channels that contradict one another, by the names of flags."""

import errno
import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager

from rpc.address import is_loopback, joined, split_address
from rpc.errors import RpcError, SettingsError
from world.errors import ConfigError

__all__ = ["address_of", "family", "flags_named", "is_loopback", "joined", "refused"]

_FIELD = re.compile(r"\b(tls_cert|tls_key|tls_client_ca|tls_ca|token_file|allow_insecure_remote)\b")


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


def refused(listen: str, error: Exception) -> ConfigError:
    """Return the error of an address at which nothing can listen, with what to do."""
    # asyncio adds the address in Python's form
    why = str(getattr(error, "strerror", None) or error).partition(" (while")[0]
    taken = getattr(error, "errno", None) in (errno.EADDRINUSE, errno.EACCES)
    advice = "; choose another port (0: any free one)" if taken else ""
    return ConfigError(f"cannot listen on '{listen}': {why}{advice}")


def family(host: str) -> socket.AddressFamily:
    """Return the family of sockets of a host name or address."""
    return socket.AF_INET6 if ":" in host else socket.AF_INET


@contextmanager
def flags_named(prefix: str = "--") -> Iterator[None]:
    """Context in which invalid settings of a server or channel are a ConfigError that names flags
    as they are typed."""
    try:
        yield
    except SettingsError as error:
        text = _FIELD.sub(lambda found: prefix + found[0].replace("_", "-"), str(error))
        raise ConfigError(text) from error
