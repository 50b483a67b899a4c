"""The use of any object, or of none: clips as they are, for tracking."""

from world.motions.clip import Clip
from world.motions.fit.objects import with_any
from world.motions.uses.bed import BED
from world.motions.uses.box import BOX
from world.motions.uses.seat import SEAT
from world.motions.uses.use import StandingObjectUse, Use
from world.scene.target import Target


class AnyUse(StandingObjectUse):
    """Whatever a clip does, with the box, bed or seat that it uses."""

    lacking, wanted = "no clip is sound", "others"

    def fit(self, clip: Clip) -> list[Clip]:
        """Parts with their objects of any use."""
        return with_any(clip)

    def read(self, clip: Clip) -> Use:
        """The use of the clip's box, else of its bed, else of its seat."""
        if clip.box is not None:
            return BOX.read(clip)
        return BED.read(clip) if clip.bed is not None else SEAT.read(clip)

    def with_object(self, clip: Clip, target: Target, run: tuple[int, int]) -> Clip:
        """The clip itself."""
        return clip


ANY = AnyUse()
