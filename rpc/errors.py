"""What can go wrong between processes, in one line each."""

import grpc


class RpcError(Exception):
    """Base of every expected failure between processes; the command line prints it as one line."""


class CodecError(RpcError):
    """Bytes that are not what they should be."""


class UnreachableError(RpcError):
    """A service that stayed away for as long as one is willing to wait."""


class RefusedError(RpcError):
    """A call that the service answered with a refusal; `code` says which kind."""

    def __init__(self, code: grpc.StatusCode, details: str) -> None:
        super().__init__(details)
        self.code = code
