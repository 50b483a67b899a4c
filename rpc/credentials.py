"""Files that prove who is who: certificates, keys and bearer tokens."""

import ssl
from pathlib import Path

import grpc

from rpc.errors import RpcError


def read_token(path: str) -> str:
    """The token in a file, without surrounding blanks; RpcError if there is none."""
    token = _read(path, "token file").decode("utf-8", "replace").strip()
    if not token or not token.isascii() or not token.isprintable():
        raise RpcError(f"token file {path}: must hold one line of printable ASCII")
    return token


def server_credentials(cert: str, key: str, client_ca: str) -> grpc.ServerCredentials:
    """TLS from a certificate and key; with `client_ca`, clients must show a certificate too."""
    pair = (_read(key, "TLS key"), _read(cert, "TLS certificate"))
    _fits(cert, key)
    roots = _read(client_ca, "client CA") if client_ca else None
    return grpc.ssl_server_credentials([pair], roots, require_client_auth=bool(client_ca))


def channel_credentials(ca: str, cert: str, key: str) -> grpc.ChannelCredentials:
    """TLS with the given roots (empty: the system's); with `cert` and `key`, mutual."""
    if cert and key:
        _fits(cert, key)
    return grpc.ssl_channel_credentials(
        _read(ca, "CA") if ca else None,
        _read(key, "TLS key") if key else None,
        _read(cert, "TLS certificate") if cert else None,
    )


def _fits(cert: str, key: str) -> None:
    """RpcError unless the key is the certificate's: gRPC says so to nobody."""
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(cert, key, password="")
    except (ssl.SSLError, ValueError, OSError) as error:
        why = str(error)
        if "KEY_VALUES_MISMATCH" in why:
            raise RpcError(f"TLS key {key}: is not that of certificate {cert}") from error
        raise RpcError(f"TLS certificate {cert} or key {key}: not readable as PEM") from error


def _read(path: str, what: str) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise RpcError(f"{what} {path}: {error.strerror}") from error
