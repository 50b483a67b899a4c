"""Errors of networks, checkpoints and requests, and the base class of the packages above."""

from world.errors import InhabitError, LayoutError

__all__ = ["CheckpointError", "InhabitError", "LayoutError"]


class CheckpointError(InhabitError):
    """A checkpoint cannot be written or read; the message names the file."""


class RequestError(InhabitError):
    """A request cannot be served; the message names the field and its valid form."""


class BusyError(InhabitError):
    """A limit of the service is reached; the message names it."""
