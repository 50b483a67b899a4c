"""Errors of networks and checkpoints, and the base that higher floors derive theirs from."""

from world.errors import InhabitError, LayoutError

__all__ = ["CheckpointError", "InhabitError", "LayoutError"]


class CheckpointError(InhabitError):
    """A checkpoint that cannot be written or read; the message names the file."""


class RequestError(InhabitError):
    """A request that cannot be served; the message names the field and its valid form."""


class BusyError(InhabitError):
    """More is asked for at once than the service takes; the message names the limit."""
