"""The affordance of a free box on a stand, with the stand of its target."""

from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from world import random_streams
from world.affordances.affordance import FURNITURE_SETTINGS, Affordance, Setting, stand
from world.config import CarryConfig, WorldConfig
from world.errors import ConfigError
from world.furniture.piece import Piece
from world.initial.box import BoxSampler
from world.initial.sampler import InitialStateSampler
from world.motions.library import MotionLibrary
from world.motions.uses.box import BOX as BOX_CLIPS
from world.objects import box_bank
from world.objects.bank import ObjectBank
from world.objects.box_bank import BoxBank, Layout, resting
from world.scene import box as box_scene
from world.scene import perturbations
from world.scene.batch import Scenes
from world.scene.target import Target

#: Least distance of a target from the character's initial position, m.
_CLEAR_M = 0.8
#: Edges of the bands of size in the figures.
_BANDS = (0.5, 0.75, 1.0, 1.25, 1.5)
#: Objects of the protocol in which the weight varies: boxes of size 1 within the first bounds, kg,
#: in bands with the second as edges.
WEIGHTS = "weights"
WEIGHTS_KG, _WEIGHT_BANDS_KG = (1.0, 12.0), (1.0, 4.0, 8.0, 12.0)
#: Sizes and stands of trials, independent of the training's configuration.
_PROTOCOL = CarryConfig()


class CarriedBox(Affordance):
    """A box to carry."""

    name, kind, clips, cargo = "carry", "box", BOX_CLIPS, True
    unused = FURNITURE_SETTINGS - {"teacher", "initial.focus"}

    def pieces(self, config: WorldConfig) -> tuple[tuple[Piece, ...], str]:
        """No furniture: the task makes its own boxes."""
        if config.objects:
            raise ConfigError("--objects: carry draws its boxes itself; leave it out")
        return (), ""

    def bank(self, config: WorldConfig) -> BoxBank:
        """See Affordance."""
        balls = perturbations.training_balls(config.perturb)
        return BoxBank(box_bank.boxes(config.carry), balls)

    def sampler(
        self, config: WorldConfig, library: MotionLibrary, bank: ObjectBank, seed: int
    ) -> InitialStateSampler:
        """See Affordance."""
        assert isinstance(bank, BoxBank), "carry needs a bank of boxes"
        return BoxSampler(config, library, bank, seed)

    def trial_pieces(
        self, objects: str, trials: int, seed: int, config: WorldConfig
    ) -> tuple[Piece, ...]:
        """One box for each trial."""
        if objects == WEIGHTS:
            return weights(trials, seed)
        if objects != "test":
            raise ConfigError("--objects: carry draws a box for each trial; leave it out")
        return boxes(trials, seed, config.carry.weight_kg)

    def arrange(self, setting: Setting) -> "BoxArrangement":
        """See Affordance."""
        return BoxArrangement(setting)

    def choices(self, objects: str) -> dict[str, Piece]:
        """The default box: its scale gives size and mass."""
        return {box_scene.box().name: box_scene.box()}

    def sized(self, piece: Piece, scale: float) -> Piece:
        """The box itself, which has its size already."""
        return piece

    def chosen(self, piece: Piece, scale: float) -> Piece:
        """See Affordance."""
        return box_scene.box(scale)


def boxes(trials: int, seed: int, weight_kg: tuple[float, float] | None) -> tuple[Piece, ...]:
    """The box of each trial: size uniform over the protocol's range, mass where the task randomises
    it."""
    u = (
        random_streams.uniform(seed, random_streams.BOX_TRIAL, torch.arange(trials), 0, 2)
        .double()
        .numpy()
    )
    low, high = _PROTOCOL.scale
    found = []
    for size, weight in u:
        scale, mass = low + (high - low) * size, None
        if weight_kg is not None:
            mass = weight_kg[0] + (weight_kg[1] - weight_kg[0]) * weight
        found.append(_named(box_scene.box(float(scale), mass), float(scale)))
    return tuple(found)


def weights(trials: int, seed: int) -> tuple[Piece, ...]:
    """The box of each trial: of size 1, its mass uniform over WEIGHTS_KG."""
    u = random_streams.uniform(seed, random_streams.BOX_TRIAL, torch.arange(trials), 0, 2)
    low, high = WEIGHTS_KG
    masses = (low + (high - low) * u[:, 1].double()).tolist()
    named = ((box_scene.box(1.0, mass), _band(mass, _WEIGHT_BANDS_KG)) for mass in masses)
    return tuple(replace(piece, name=f"box {band} kg") for piece, band in named)


def _named(piece: Piece, scale: float) -> Piece:
    return replace(piece, name=f"box {_band(scale, _BANDS)}")


def _band(value: float, edges: tuple[float, ...]) -> str:
    """The band of a value, as in 0.5-0.75."""
    band = int(np.clip(np.searchsorted(edges, value, side="right") - 1, 0, len(edges) - 2))
    return f"{edges[band]:g}-{edges[band + 1]:g}"


class BoxArrangement:
    """Boxes on stands, each with the stand of its target; an Arrangement."""

    def __init__(self, setting: Setting) -> None:
        self.bank = BoxBank(setting.pieces, setting.disturbance.balls())
        self.models = self.bank.models
        self.point = setting.point
        self._layout = stacked_layout(setting)

    def begin(self, scenes: Scenes) -> Target:
        """See Arrangement."""
        every, layout = torch.arange(scenes.n), self._layout
        stand(scenes, layout.start, layout.start_yaw)
        self.bank.apply(scenes, every, every, layout)
        return self.bank.target(every, layout)

    def move(self, scenes: Scenes, ids: Tensor, point: Tensor, facing: Tensor) -> Target:
        """See Arrangement: moves the initial stands with the boxes on them."""
        part = self._layout.rows(ids)
        moved = self.bank.shift(scenes, ids, ids, part, point, facing)
        for name in ("position", "rotation", "start", "start_yaw"):
            getattr(self._layout, name)[ids] = getattr(moved, name)
        return scenes.now(self.bank.target(ids, self._layout.rows(ids)), ids)


def stacked_layout(setting: Setting) -> Layout:
    """Layout of boxes at rest above the setting's points, with targets target_m away, any
    bearing."""
    point = setting.point
    u = random_streams.uniform(
        setting.seed, random_streams.BOX_TRIAL, torch.from_numpy(setting.trials), 1, 4
    )
    half = torch.tensor([piece.boxes[0].half_m[2] for piece in setting.pieces])
    low, high = _PROTOCOL.stand_m
    start = torch.cat((point, (half + low + (high - low) * u[:, 0])[:, None]), dim=1)
    low, high = setting.target_m
    angle = 2 * torch.pi * u[:, 2]
    unit = torch.stack((angle.cos(), angle.sin()), dim=1)
    offset = (low + (high - low) * u[:, 1])[:, None] * unit
    blocked = (point + offset).norm(dim=1) < _CLEAR_M
    there = torch.where(blocked[:, None], point - offset, point + offset)
    low, high = _PROTOCOL.stand_m
    target = torch.cat((there, (half + low + (high - low) * u[:, 3])[:, None]), dim=1)
    return resting(start, setting.facing, target)


CARRIED = CarriedBox()
