"""Errors of fleets."""

from world.errors import InhabitError


class FleetError(InhabitError):
    """Actors are lost or keep failing; the message has the last cause."""
