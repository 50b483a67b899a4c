"""Errors of communication between processes."""

import grpc


class RpcError(Exception):
    """Base of all expected failures between processes; the command line prints one line."""


class CodecError(RpcError):
    """A message or array is malformed."""


class SettingsError(RpcError):
    """Settings of a server or channel are invalid, contradict one another, or leave an address
    unprotected; fields have their names in `ServerConfig` and `ChannelConfig`."""


class UnreachableError(RpcError):
    """A service is unreachable for longer than the retry time."""


class RefusedError(RpcError):
    """A service refuses a call; `code` is the status."""

    def __init__(self, code: grpc.StatusCode, details: str) -> None:
        super().__init__(details)
        self.code = code
