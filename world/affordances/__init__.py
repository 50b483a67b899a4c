"""Affordances of objects, one record each: training objects, initial states and trials. A new one
is a file here."""

from world.affordances.affordance import Affordance
from world.affordances.box import CARRIED
from world.affordances.floor import FLOOR
from world.affordances.furniture import BED, SEAT
from world.affordances.reference import REFERENCE

__all__ = ["BED", "CARRIED", "FLOOR", "REFERENCE", "SEAT", "Affordance"]
