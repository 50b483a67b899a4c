"""What a task's object offers, one record a kind of object: how objects, initial states and trials
are made. A new kind is a file here."""

from world.affordances.affordance import Affordance
from world.affordances.box import CARRIED
from world.affordances.floor import FLOOR
from world.affordances.furniture import BED, SEAT

__all__ = ["BED", "CARRIED", "FLOOR", "SEAT", "Affordance"]
