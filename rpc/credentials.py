"""Credentials from files: certificates, keys and bearer tokens."""

import ssl
from pathlib import Path

import grpc

from rpc.errors import SettingsError


def read_token(path: str) -> str:
    """Token of a file, without surrounding white space; SettingsError if there is none."""
    token = _read(path, "token file").decode("utf-8", "replace").strip()
    if not token or not token.isascii() or not token.isprintable():
        raise SettingsError(f"token file {path}: must hold one line of printable ASCII")
    return token


def server_credentials(cert: str, key: str, client_ca: str) -> grpc.ServerCredentials:
    """Server credentials of a certificate and key; with `client_ca`, of mutual TLS."""
    pair = (_read(key, "TLS key"), _read(cert, "TLS certificate"))
    _check_pair(cert, key)
    roots = _read(client_ca, "client CA") if client_ca else None
    return grpc.ssl_server_credentials([pair], roots, require_client_auth=bool(client_ca))


def channel_credentials(ca: str, cert: str, key: str) -> grpc.ChannelCredentials:
    """Client credentials with root certificates `ca` (empty: the system's); `cert`, `key`: mutual
    TLS."""
    if cert and key:
        _check_pair(cert, key)
    return grpc.ssl_channel_credentials(
        _read(ca, "CA") if ca else None,
        _read(key, "TLS key") if key else None,
        _read(cert, "TLS certificate") if cert else None,
    )


def _check_pair(cert: str, key: str) -> None:
    """Raise SettingsError unless the key belongs to the certificate, which gRPC does not report."""
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(cert, key, password="")
    except (ssl.SSLError, ValueError, OSError) as error:
        why = str(error)
        if "KEY_VALUES_MISMATCH" in why:
            raise SettingsError(f"TLS key {key}: is not that of certificate {cert}") from error
        raise SettingsError(f"TLS certificate {cert} or key {key}: not readable as PEM") from error


def _read(path: str, what: str) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise SettingsError(f"{what} {path}: {error.strerror}") from error
