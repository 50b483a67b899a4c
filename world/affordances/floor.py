"""The affordance of an empty floor: any of its points."""

from torch import Tensor

from world.affordances.affordance import Affordance, Setting, stand
from world.config import WorldConfig
from world.errors import ConfigError
from world.furniture.piece import Piece
from world.initial.floor import FloorSampler
from world.initial.sampler import InitialStateSampler
from world.motions.library import MotionLibrary
from world.motions.uses.floor import FLOOR as FLOOR_CLIPS
from world.objects.bank import ObjectBank
from world.objects.floor_bank import MARKER, FloorBank
from world.scene import perturbations
from world.scene.batch import Scenes
from world.scene.target import Target

_NONE = "--objects: this task needs no furniture; leave it out"


class Floor(Affordance):
    """A floor to stand on."""

    name, kind, clips = "stand", "floor", FLOOR_CLIPS

    def pieces(self, config: WorldConfig) -> tuple[tuple[Piece, ...], str]:
        """No furniture."""
        if config.objects:
            raise ConfigError(_NONE)
        return (), ""

    def bank(self, config: WorldConfig) -> FloorBank:
        """See Affordance."""
        return FloorBank(perturbations.training_balls(config.perturb))

    def sampler(
        self, config: WorldConfig, library: MotionLibrary, bank: ObjectBank, seed: int
    ) -> InitialStateSampler:
        """See Affordance."""
        assert isinstance(bank, FloorBank), "the floor needs its own bank"
        return FloorSampler(config, library, bank, seed)

    def trial_pieces(
        self, objects: str, trials: int, seed: int, config: WorldConfig
    ) -> tuple[Piece, ...]:
        """The marker of the target."""
        if objects != "test":
            raise ConfigError(_NONE)
        return (MARKER,)

    def arrange(self, setting: Setting) -> "FloorArrangement":
        """See Affordance."""
        return FloorArrangement(setting)

    def choices(self, objects: str) -> dict[str, Piece]:
        """The marker."""
        return {MARKER.name: MARKER}

    def sized(self, piece: Piece, scale: float) -> Piece:
        """The marker itself, which has one size."""
        return piece


class FloorArrangement:
    """An empty floor with a target on it; an Arrangement."""

    def __init__(self, setting: Setting) -> None:
        self.bank = FloorBank(setting.disturbance.balls(), len(setting.pieces))
        self.models = self.bank.models
        self.point = setting.point
        self._setting = setting

    def begin(self, scenes: Scenes) -> Target:
        """See Arrangement."""
        point, facing = self._setting.point, self._setting.facing
        stand(scenes, *self.bank.placed(point, facing))
        return self.bank.target(point, facing)

    def move(self, scenes: Scenes, ids: Tensor, point: Tensor, facing: Tensor) -> Target:
        """See Arrangement."""
        scenes.move_furniture(ids, *self.bank.placed(point, facing))
        return self.bank.target(point, facing)


FLOOR = Floor()
