"""The affordance of reference motions: clips to follow, each with the object that it uses."""

from world.affordances.affordance import FURNITURE_SETTINGS, Affordance, Arrangement, Setting
from world.config import WorldConfig
from world.errors import ConfigError
from world.furniture.piece import Piece
from world.initial.sampler import InitialStateSampler
from world.motions import load
from world.motions.library import MotionLibrary
from world.motions.uses.any_object import ANY
from world.motions.uses.use import ClipUse
from world.objects.bank import ObjectBank
from world.tracking.arrivals import Arrivals
from world.tracking.bank import TrackBank
from world.tracking.reference import reference
from world.tracking.rollouts import Rollouts
from world.tracking.sampler import TrackSampler

#: Why objects cannot be chosen.
_OWN = "a task that follows clips takes their objects; choose clips with --motions"


class ReferenceMotion(Affordance):
    """Clips to follow."""

    name, kind, clips, follows_clips = "follow", "reference", ANY, True
    unused = FURNITURE_SETTINGS | {"initial"}

    def pieces(self, config: WorldConfig) -> tuple[tuple[Piece, ...], str]:
        """No furniture: the clips bring their objects."""
        if config.objects:
            raise ConfigError(f"--objects: {_OWN}")
        return (), ""

    def bank(self, config: WorldConfig) -> TrackBank:
        """See Affordance."""
        clips = load.cached_library(
            config.motions, config.mirror, self.clips, config.playback_speeds
        ).clips
        return TrackBank(
            clips, reference(clips, config.track.handling, config.track.solid), config.track
        )

    def showing(self, config: WorldConfig, bank: ObjectBank, use: ClipUse) -> ObjectBank:
        """See Affordance: initial states in the clips alone that have the object of `use`."""
        assert isinstance(bank, TrackBank), "tracking needs a bank of clips"
        clips = load.cached_library(
            config.motions, config.mirror, self.clips, config.playback_speeds
        ).clips
        return bank.starting_in([use.read(clip).has_object for clip in clips])

    def joined_from(
        self, bank: ObjectBank, arrivals: Arrivals | None, rollouts: Rollouts | None
    ) -> ObjectBank:
        """See Affordance."""
        assert isinstance(bank, TrackBank), "tracking needs a bank of clips"
        return bank.joined_from(arrivals, rollouts)

    def sampler(
        self, config: WorldConfig, library: MotionLibrary, bank: ObjectBank, seed: int
    ) -> InitialStateSampler:
        """See Affordance."""
        assert isinstance(bank, TrackBank), "tracking needs a bank of clips"
        return TrackSampler(config, bank, seed)

    def trial_pieces(
        self, objects: str, trials: int, seed: int, config: WorldConfig
    ) -> tuple[Piece, ...]:
        """ConfigError: trials follow clips."""
        raise ConfigError(_OWN)

    def arrange(self, setting: Setting) -> Arrangement:
        """ConfigError: trials follow clips."""
        raise ConfigError(_OWN)

    def choices(self, objects: str) -> dict[str, Piece]:
        """ConfigError: the player shows recorded trials."""
        raise ConfigError(_OWN)

    def sized(self, piece: Piece, scale: float) -> Piece:
        """The piece itself, which has one size."""
        return piece


REFERENCE = ReferenceMotion()
