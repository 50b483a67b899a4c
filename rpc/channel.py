"""Client channel that retries calls while a service is unreachable."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import grpc

from rpc.address import is_local, split_address
from rpc.credentials import channel_credentials, read_token
from rpc.errors import RefusedError, SettingsError, UnreachableError

Reply = TypeVar("Reply")
Metadata = list[tuple[str, str]]
AWAY = (
    grpc.StatusCode.UNAVAILABLE,
    grpc.StatusCode.DEADLINE_EXCEEDED,
    grpc.StatusCode.RESOURCE_EXHAUSTED,  # too many calls in progress
    grpc.StatusCode.CANCELLED,  # a draining server ends calls that outlast its drain time
)
"""Statuses of calls that are retried"""
FIRST_PAUSE_S, LAST_PAUSE_S = 0.1, 2.0


@dataclass(frozen=True)
class ChannelConfig:
    """Address, credentials and time-outs of a service."""

    address: str = "127.0.0.1:0"
    """HOST:PORT or unix:PATH."""
    tls: bool = False
    """Use TLS with the system's root certificates (implied by `tls_ca` and `tls_cert`)."""
    tls_ca: str = ""
    """File with the trusted certificates."""
    tls_cert: str = ""
    """File with the client's certificate, for mutual TLS."""
    tls_key: str = ""
    """File with the client's key."""
    token_file: str = ""
    """File with the bearer token."""
    token: str = field(default="", repr=False)
    """The bearer token itself, instead of a file."""
    deadline_s: float = 120.0
    """Longest time of one attempt, s."""
    retry_s: float = 900.0
    """Longest time of a call with all its retries, s."""
    allow_insecure_remote: bool = False
    """Send the token to another machine without TLS."""


def is_secure(config: ChannelConfig) -> bool:
    """Return whether the settings ask for TLS."""
    return config.tls or bool(config.tls_ca or config.tls_cert)


def token_of(config: ChannelConfig) -> str:
    """Return the token that the settings name; empty without one.

    Raises SettingsError for an invalid address or token file, and where the token would be shown to
    another machine without TLS.
    """
    if not config.address.startswith("unix:"):
        split_address(config.address)
    if not (config.token_file or config.token):
        return ""
    if not is_secure(config) and not is_local(config.address) and not config.allow_insecure_remote:
        raise SettingsError(
            f"{config.address}: a token is not shown to another machine without TLS: give tls-ca"
        )
    return config.token or read_token(config.token_file)


class Channel:
    """A gRPC channel whose calls are retried until the service answers or `retry_s` is over.

    Calls must be idempotent. A refused call (bad argument, no permission) is not retried.
    """

    def __init__(
        self,
        config: ChannelConfig,
        name: str,
        report: Callable[[str], None] | None = None,
        lost: Callable[[], str | None] | None = None,
        metadata: Sequence[tuple[str, str]] = (),
    ) -> None:
        """name: of the service, for messages. report: called with one line per outage and per
        recovery. lost: returns why the service cannot come back, else None. metadata: sent with
        each call."""
        self.config, self.name = config, name
        self._report = report or (lambda line: None)
        self._lost = lost or (lambda: None)
        self._metadata: Metadata = list(metadata)
        secure = is_secure(config)
        if token := token_of(config):
            self._metadata.append(("authorization", f"Bearer {token}"))
        options: list[tuple[str, int | str]] = [
            ("grpc.initial_reconnect_backoff_ms", 100),
            ("grpc.max_reconnect_backoff_ms", 2000),
            # Time-out of an attempt to connect. The default of 20 s delays recovery if the network
            # comes back during an attempt.
            ("grpc.min_reconnect_backoff_ms", 7000),
            # A connection that loses all packets is closed after the sum of these two.
            ("grpc.keepalive_time_ms", 5_000),
            ("grpc.keepalive_timeout_ms", 4_000),
            ("grpc.http2.ping_timeout_ms", 4_000),
            ("grpc.http2.max_pings_without_data", 0),  # any number
            ("grpc.enable_http_proxy", 0),
        ]
        if secure:
            credentials = channel_credentials(config.tls_ca, config.tls_cert, config.tls_key)
            self.grpc = grpc.secure_channel(config.address, credentials, options)
        else:
            self.grpc = grpc.insecure_channel(config.address, options)

    def call(self, attempt: Callable[[float, Metadata], Reply]) -> Reply:
        """Result of `attempt(timeout_s, metadata)`, retried while the service is unreachable.

        Raises UnreachableError after `retry_s` or when the service is lost, RefusedError for any
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
                if why := _certificate_problem(details):
                    raise UnreachableError(
                        f"{self.name} at {self.config.address}: {why}"
                    ) from error
                if reason := self._lost():
                    raise UnreachableError(reason) from error
                waited = time.monotonic() - began
                if waited + pause >= self.config.retry_s:
                    raise UnreachableError(
                        f"{self.name} at {self.config.address} did not answer for {waited:.0f} s "
                        f"({_first_line(details)}): start it"
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
        """Close the connection."""
        self.grpc.close()


def _status(error: grpc.RpcError) -> tuple[grpc.StatusCode, str]:
    if isinstance(error, grpc.Call):
        return error.code() or grpc.StatusCode.UNKNOWN, error.details() or "no details"
    return grpc.StatusCode.UNKNOWN, str(error)


def _certificate_problem(details: str) -> str:
    """The problem with a certificate that an error's details name; empty without one."""
    text = details.lower()
    for words, why in _CERTIFICATE_PROBLEMS.items():
        if words in text:
            return why
    return ""


_OTHER_NAME = "its certificate is for another name: give the address that it is for"
_UNKNOWN_CA = "its certificate is signed by no trusted authority: give tls_ca"
_CERTIFICATE_PROBLEMS = {
    "certificate has expired": "its certificate has expired: renew it",
    "certificate is not yet valid": "its certificate is not valid yet: check both clocks",
    "hostname verification": _OTHER_NAME,
    "peer name": _OTHER_NAME,
    "self-signed certificate": _UNKNOWN_CA,
    "self signed certificate": _UNKNOWN_CA,
    "unable to get local issuer": _UNKNOWN_CA,
    "certificate signature failure": "its certificate is not signed by those of tls_ca",
    "certificate verify failed": "its certificate is not trusted: give the tls_ca that signed it",
    "certificate_verify_failed": "its certificate is not trusted: give the tls_ca that signed it",
}


def _first_line(text: str) -> str:
    return text.splitlines()[0][:160] if text else ""
