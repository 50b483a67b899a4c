"""Errors of the style reward."""

from world.errors import InhabitError


class StyleError(InhabitError):
    """Transitions cannot be scored, or settings are invalid."""


class TurnError(StyleError):
    """A call out of order: another version or batch is due first."""
