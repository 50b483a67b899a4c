"""What goes wrong with fleets."""

from world.errors import InhabitError


class FleetError(InhabitError):
    """Actors that are lost or keep failing; the message has the last cause."""
