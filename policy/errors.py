"""Errors of networks and checkpoints, and the base that higher floors derive theirs from."""

from world.errors import InhabitError, LayoutError

__all__ = ["CheckpointError", "InhabitError", "LayoutError"]


class CheckpointError(InhabitError):
    """A checkpoint that cannot be written or read; the message names the file."""
