"""The client's end: a channel that waits for a service that is away, instead of failing."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import grpc

from rpc.address import is_local, split_address
from rpc.credentials import channel_credentials, read_token
from rpc.errors import RefusedError, RpcError, UnreachableError

Reply = TypeVar("Reply")
Metadata = list[tuple[str, str]]
AWAY = (
    grpc.StatusCode.UNAVAILABLE,
    grpc.StatusCode.DEADLINE_EXCEEDED,
    grpc.StatusCode.RESOURCE_EXHAUSTED,  # too many calls in progress
    grpc.StatusCode.CANCELLED,  # what a draining server gives those that outlast its patience
)
FIRST_PAUSE_S, LAST_PAUSE_S = 0.1, 2.0


@dataclass(frozen=True)
class ChannelConfig:
    """How to reach a service, and how long to wait for it."""

    address: str = "127.0.0.1:0"
    """HOST:PORT or unix:PATH."""
    tls: bool = False
    """Speak TLS, trusting the system's roots (implied by `tls_ca` and `tls_cert`)."""
    tls_ca: str = ""
    """File with the certificates to trust."""
    tls_cert: str = ""
    """File with our own certificate, where the service asks for one."""
    tls_key: str = ""
    """File with our own key."""
    tls_name: str = ""
    """Name expected in the service's certificate, if it is not the host's."""
    token_file: str = ""
    """File with the bearer token to show."""
    token: str = field(default="", repr=False)
    """The token itself, where no file has it."""
    deadline_s: float = 120.0
    """Longest time for one call."""
    retry_s: float = 900.0
    """Longest time that a call waits for a service that is away, retries included."""
    allow_insecure_remote: bool = False
    """Show the token to another machine without TLS."""


class Channel:
    """A gRPC channel whose calls are repeated until the service answers or patience ends.

    Calls must be idempotent. One that is refused (bad argument, no permission) is not repeated.
    """

    def __init__(
        self,
        config: ChannelConfig,
        name: str,
        report: Callable[[str], None] | None = None,
        lost: Callable[[], str | None] | None = None,
        metadata: Sequence[tuple[str, str]] = (),
    ) -> None:
        """`name`: what to call the service; `report`: gets one line per outage and per return; `lost`:
        why the service will never come back, None as long as it may; `metadata`: shown with each
        call."""
        self.config, self.name = config, name
        self._report = report or (lambda line: None)
        self._lost = lost or (lambda: None)
        self._metadata: Metadata = list(metadata)
        secure = config.tls or bool(config.tls_ca or config.tls_cert)
        if not config.address.startswith("unix:"):
            split_address(config.address)
        if config.token_file or config.token:
            if not secure and not is_local(config.address) and not config.allow_insecure_remote:
                raise RpcError(
                    f"{config.address}: a token is not shown to another machine without TLS; "
                    "give tls_ca, or allow_insecure_remote"
                )
            token = config.token or read_token(config.token_file)
            self._metadata.append(("authorization", f"Bearer {token}"))
        options: list[tuple[str, int | str]] = [
            ("grpc.initial_reconnect_backoff_ms", 100),
            ("grpc.max_reconnect_backoff_ms", 2000),
            # What an attempt to connect may take: 20 s by default, of which most is waited in vain
            # where the network comes back meanwhile.
            ("grpc.min_reconnect_backoff_ms", 7000),
            # A connection whose packets vanish is given up after the sum of these two.
            ("grpc.keepalive_time_ms", 5_000),
            ("grpc.keepalive_timeout_ms", 4_000),
            ("grpc.http2.ping_timeout_ms", 4_000),
            ("grpc.http2.max_pings_without_data", 0),  # any number
            ("grpc.enable_http_proxy", 0),
        ]
        if config.tls_name:
            options.append(("grpc.ssl_target_name_override", config.tls_name))
        if secure:
            credentials = channel_credentials(config.tls_ca, config.tls_cert, config.tls_key)
            self.grpc = grpc.secure_channel(config.address, credentials, options)
        else:
            self.grpc = grpc.insecure_channel(config.address, options)

    def call(self, attempt: Callable[[float, Metadata], Reply]) -> Reply:
        """The result of `attempt(timeout_s, metadata)`, repeated while the service is away.

        Raises UnreachableError when patience ends or the service is lost, RefusedError for any
        other failure.
        """
        began, pause, away = time.monotonic(), FIRST_PAUSE_S, False
        while True:
            left = self.config.retry_s - (time.monotonic() - began)
            try:
                reply = attempt(min(self.config.deadline_s, max(left, 0.1)), self._metadata)
            except grpc.RpcError as error:
                code, details = _status(error)
                if code not in AWAY:
                    raise RefusedError(code, details) from error
                if why := _distrust(details):
                    raise UnreachableError(
                        f"{self.name} at {self.config.address}: {why}"
                    ) from error
                if reason := self._lost():
                    raise UnreachableError(reason) from error
                waited = time.monotonic() - began
                if waited + pause >= self.config.retry_s:
                    raise UnreachableError(
                        f"{self.name} at {self.config.address} did not answer for {waited:.0f} s "
                        f"({_first_line(details)}): start it, or raise retry_s "
                        f"({self.config.retry_s:g})"
                    ) from error
                if not away:
                    self._report(
                        f"{self.name} at {self.config.address} is away: waiting up to "
                        f"{self.config.retry_s:g} s"
                    )
                away = True
                time.sleep(pause)
                pause = min(2 * pause, LAST_PAUSE_S)
                continue
            if away:
                self._report(f"{self.name} is back after {time.monotonic() - began:.1f} s")
            return reply

    def close(self) -> None:
        """Let go of the connection."""
        self.grpc.close()


def _status(error: grpc.RpcError) -> tuple[grpc.StatusCode, str]:
    if isinstance(error, grpc.Call):
        return error.code() or grpc.StatusCode.UNKNOWN, error.details() or "no details"
    return grpc.StatusCode.UNKNOWN, str(error)


def _distrust(details: str) -> str:
    """What of the certificates is wrong, where that is why nobody answers."""
    text = details.lower()
    for words, why in _DISTRUST.items():
        if words in text:
            return why
    return ""


_STRANGE = "its certificate is signed by nobody who is trusted here: give tls_ca"
_DISTRUST = {
    "certificate has expired": "its certificate has expired: renew it",
    "certificate is not yet valid": "its certificate is not valid yet: look at both clocks",
    "hostname verification": "its certificate is for another name: give the right address or"
    " tls_name",
    "peer name": "its certificate is for another name: give the right address or tls_name",
    "self-signed certificate": _STRANGE,
    "self signed certificate": _STRANGE,
    "unable to get local issuer": _STRANGE,
    "certificate signature failure": "its certificate is not signed by those of tls_ca",
    "certificate verify failed": "its certificate is not trusted: give the tls_ca that signed it",
    "certificate_verify_failed": "its certificate is not trusted: give the tls_ca that signed it",
}


def _first_line(text: str) -> str:
    return text.splitlines()[0][:160] if text else ""
