"""What can go wrong with the style reward, in one line each."""

from world.errors import InhabitError


class StyleError(InhabitError):
    """Transitions that cannot be scored, or settings that cannot be met."""


class TurnError(StyleError):
    """A call out of turn: another version or batch is due first."""
