"""The affordances of furniture: to sit and to lie on."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor

from world.affordances.affordance import Affordance, ClipStates, Setting, stand
from world.config import WorldConfig
from world.errors import ChoiceError, ConfigError
from world.furniture.bands import Split
from world.furniture.catalogue import COUNTS, SEATS, catalogue
from world.furniture.piece import Piece
from world.furniture.usage import LIE, SIT, Usage, usage, use_points
from world.initial.furniture import FurnitureSampler, furniture_pose
from world.initial.sampler import InitialStateSampler
from world.meshes import collection, held_out
from world.motions.library import MotionLibrary
from world.motions.uses.bed import BED as BED_CLIPS
from world.motions.uses.seat import SEAT as SEAT_CLIPS
from world.motions.uses.use import ClipUse
from world.objects.bank import ObjectBank
from world.objects.furniture_bank import FurnitureBank, scaled, variants
from world.scene import perturbations
from world.scene.batch import Scenes
from world.scene.target import Target

#: Splits of the package's own pieces for trials.
SPLITS: tuple[Split, ...] = ("test", "train")
#: Least number of test pieces of a class.
TEST_PIECES = 3


class Furniture(Affordance):
    """Furniture with one usage."""

    kind = "furniture"
    unused = frozenset({"teacher"})

    def __init__(
        self,
        use: Usage,
        clips: ClipUse,
        classes: tuple[str, ...] = (),
        older: tuple[str, ...] = (),
    ) -> None:
        """classes: classes of the catalogue; empty: all that have the usage. older: those of
        trainings that record none."""
        self.name, self.clips, self.classes, self._older = use.name, clips, classes, older

    def own(
        self, split: Split, count: int | None, seed: int, classes: tuple[str, ...] = ()
    ) -> tuple[Piece, ...]:
        """The first `count` of the package's own pieces, by default TEST_PIECES of each class or
        60 for training."""
        names = classes or self.classes or usage(self.name).classes
        if count is None and split == "test":
            count = max(COUNTS[split], TEST_PIECES * len(names))
        return catalogue(split, count, seed, names, self.name)

    def trained(self, config: WorldConfig, count: int | None, seed: int) -> tuple[Piece, ...]:
        """The package's own training pieces of a configuration."""
        return self.own("train", count, seed, config.classes or self._older)

    def pieces(self, config: WorldConfig) -> tuple[tuple[Piece, ...], str]:
        """See Affordance."""
        found: list[Piece] = []
        left_out = 0
        for name in config.objects or ("train",):
            if name == "train":
                found += self.trained(config, config.pieces, config.seed)
            elif name in collection.SPLITS:
                raise ConfigError(
                    f"--objects {name}: the test pieces are held out; choose train or a path"
                )
            else:
                imported = collection.pieces([name])
                own = imported if config.held_out else held_out.kept(imported, Path(name))
                left_out += len(imported) - len(own)
                found += own
        usable = collection.usable(found, self.name, ", ".join(config.objects))
        taken = {id(piece) for piece in usable}
        idle = [piece.name for piece in found if id(piece) not in taken]
        said = [f"{left_out} imported pieces are held out of training"] if left_out else []
        if idle:
            few = ", ".join(idle[:4]) + (", ..." if len(idle) > 4 else "")
            said.append(f"{len(idle)} of {len(found)} pieces have no place to {self.name}: {few}")
        return usable, "; ".join(said)

    def bank(self, config: WorldConfig) -> FurnitureBank:
        """See Affordance."""
        pieces = variants(self.pieces(config)[0], config.scales, config.scale)
        return FurnitureBank(pieces, self.name, perturbations.training_balls(config.perturb))

    def sampler(
        self, config: WorldConfig, library: MotionLibrary, bank: ObjectBank, seed: int
    ) -> InitialStateSampler:
        """See Affordance."""
        assert isinstance(bank, FurnitureBank), "furniture needs a bank of furniture"
        return FurnitureSampler(config, library, bank, seed)

    def trial_pieces(
        self, objects: str, trials: int, seed: int, config: WorldConfig
    ) -> tuple[Piece, ...]:
        """See Affordance."""
        return self.trained(config, None, 0) if objects == "train" else self.named(objects)

    def named(self, objects: str) -> tuple[Piece, ...]:
        """The pieces of a split of the package's catalogue, or those of a path that can be used.

        Raises ChoiceError, which lists the splits, for a path that is not there; PieceError where
        none of its pieces can be used.
        """
        for split in SPLITS:
            if objects == split:
                return self.own(split, None, 0)
        if not Path(objects).exists():
            raise ChoiceError("--objects", objects, [*SPLITS, "a folder of pieces"])
        return collection.usable(collection.pieces([objects]), self.name, objects)

    def arrange(self, setting: Setting) -> "FurnitureArrangement":
        """See Affordance."""
        return FurnitureArrangement(setting, self.name)

    def choices(self, objects: str) -> dict[str, Piece]:
        """See Affordance."""
        return {piece.name: piece for piece in self.named(objects)}

    def sized(self, piece: Piece, scale: float) -> Piece:
        """See Affordance."""
        return scaled(piece, scale)

    def use_point_count(self, piece: Piece) -> int:
        """See Affordance."""
        return len(use_points(piece, self.name))

    def clip_states(
        self,
        config: WorldConfig,
        library: MotionLibrary,
        pieces: Sequence[Piece],
        seed: int,
        n: int,
    ) -> ClipStates | None:
        """See Affordance."""
        if not any(len(stage) for stage in library.stages):
            return None
        only = replace(config, initial=replace(config.initial, reference=1.0, near=0.0, far=0.0))
        bank = FurnitureBank(pieces, self.name)
        ids = torch.arange(n)
        states = FurnitureSampler(only, library, bank, seed).draw(ids, torch.ones_like(ids))
        models = [bank.models[int(variant)] for variant in states.variant]
        return ClipStates(models, states.qpos, *furniture_pose(bank, states))


class FurnitureArrangement:
    """Pieces of furniture, placed by their use points; an Arrangement."""

    def __init__(self, setting: Setting, affordance: str) -> None:
        self.bank = FurnitureBank(setting.pieces, affordance, setting.disturbance.balls())
        self.models = self.bank.models
        self._facing, self.point = setting.facing, setting.point
        if not usage(affordance).wide:
            every, never = torch.arange(len(self.bank)), torch.zeros(len(self.bank)) > 0.0
            self.point = self.bank.clear_of(every, setting.point, setting.facing, never)

    def begin(self, scenes: Scenes) -> Target:
        """See Arrangement."""
        every = torch.arange(scenes.n)
        stand(scenes, *self.bank.placed(every, self.point, self._facing))
        return self.bank.target(every, self.point, self._facing)

    def move(self, scenes: Scenes, ids: Tensor, point: Tensor, facing: Tensor) -> Target:
        """See Arrangement."""
        scenes.move_furniture(ids, *self.bank.placed(ids, point, facing))
        return self.bank.target(ids, point, facing)


#: Sofas and beds are sat on as well; runs of earlier versions were trained on the four classes that
#: are made to sit on alone.
SEAT = Furniture(SIT, SEAT_CLIPS, (*SEATS, "sofa", "bed"), SEATS)
BED = Furniture(LIE, BED_CLIPS)
