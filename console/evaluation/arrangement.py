"""How the objects of a chunk of trials stand about their characters: furniture, or boxes."""

from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from world import random_streams
from world.character import model as character
from world.config import CarryConfig
from world.furniture.piece import Affordance as Offered
from world.furniture.piece import Piece
from world.objects.box_bank import BoxBank, Layout, resting
from world.objects.furniture_bank import Bank, scaled
from world.scene import box as box_scene
from world.scene.batch import Scenes
from world.scene.perturbations import Disturbance
from world.tasks import Place
from world.tasks.task import Affordance

#: Key of what carry draws besides among the streams (the trials' own is 101).
_CARRY = 104
#: Where a target is not put: this near to the character's start, m.
_CLEAR_M = 0.8
#: Bands of size by which boxes are told apart in the figures.
_BANDS = (0.5, 0.75, 1.0, 1.25, 1.5)
#: Sizes and stands of trials, whatever a policy was trained on.
_PROTOCOL = CarryConfig()


def boxes(trials: int, seed: int, weight_kg: tuple[float, float] | None) -> tuple[Piece, ...]:
    """The box of each trial: its size uniform over the protocol's, and its weight where the task
    randomises it."""
    u = random_streams.uniform(seed, _CARRY, torch.arange(trials), 0, 2).double().numpy()
    low, high = _PROTOCOL.scale
    found = []
    for size, weight in u:
        scale, mass = low + (high - low) * size, None
        if weight_kg is not None:
            mass = weight_kg[0] + (weight_kg[1] - weight_kg[0]) * weight
        found.append(_named(box_scene.box(float(scale), mass), float(scale)))
    return tuple(found)


def _named(piece: Piece, scale: float) -> Piece:
    band = int(np.clip(np.searchsorted(_BANDS, scale, side="right") - 1, 0, len(_BANDS) - 2))
    return replace(piece, name=f"box {_BANDS[band]:g}-{_BANDS[band + 1]:g}")


class Furnished:
    """Pieces of furniture, placed by their place of use."""

    def __init__(
        self,
        pieces: list[Piece],
        affordance: Offered,
        what: Disturbance,
        point: Tensor,
        facing: Tensor,
    ) -> None:
        """point [n, 2] m and facing [n, 2] (cosine, sine): of the places, on the floor."""
        self.bank = Bank(pieces, affordance, what.balls())
        self.models = self.bank.models
        self.point, self.facing = point, facing

    def begin(self, scenes: Scenes) -> Place:
        """Furniture and standing characters in their places."""
        every = torch.arange(scenes.n)
        stand(scenes, *self.bank.placed(every, self.point, self.facing))
        return self.bank.place(every, self.point, self.facing)

    def move(self, scenes: Scenes, ids: Tensor, point: Tensor, facing: Tensor) -> Place:
        """The furniture of the scenes `ids` [m] put elsewhere; its places there."""
        scenes.move_furniture(ids, *self.bank.placed(ids, point, facing))
        return self.bank.place(ids, point, facing)


class Stacked:
    """Boxes on stands, with a stand to bring each to."""

    def __init__(
        self, pieces: list[Piece], what: Disturbance, layout: Layout, point: Tensor, facing: Tensor
    ) -> None:
        self.bank = BoxBank(pieces, what.balls())
        self.models = self.bank.models
        self._layout = layout
        self.point, self.facing = point, facing

    def begin(self, scenes: Scenes) -> Place:
        """Boxes, stands and standing characters in their places."""
        every, layout = torch.arange(scenes.n), self._layout
        stand(scenes, layout.start, layout.start_yaw)
        self.bank.put(scenes, every, every, layout)
        return self.bank.place(every, layout)

    def move(self, scenes: Scenes, ids: Tensor, point: Tensor, facing: Tensor) -> Place:
        """The first stands of the scenes `ids` [m] put elsewhere, boxes on them too; the places
        then."""
        part = self._layout.rows(ids)
        moved = self.bank.shift(scenes, ids, ids, part, point, facing)
        for name in ("position", "rotation", "start", "start_yaw"):
            getattr(self._layout, name)[ids] = getattr(moved, name)
        return scenes.now(self.bank.place(ids, self._layout.rows(ids)), ids)


def stacked_layout(
    pieces: list[Piece],
    point: Tensor,
    facing: Tensor,
    trials: NDArray[np.int64],
    seed: int,
    target_m: tuple[float, float],
) -> Layout:
    """Boxes at rest above the floor points [n, 2] m with the yaws facing [n, 2], and targets
    target_m from them, at any bearing; of the trials numbered [n]."""
    u = random_streams.uniform(seed, _CARRY, torch.from_numpy(trials), 1, 4)
    half = torch.tensor([piece.boxes[0].half_m[2] for piece in pieces])
    low, high = _PROTOCOL.stand_m
    start = torch.cat((point, (half + low + (high - low) * u[:, 0])[:, None]), dim=1)
    low, high = target_m
    angle = 2 * torch.pi * u[:, 2]
    unit = torch.stack((angle.cos(), angle.sin()), dim=1)
    offset = (low + (high - low) * u[:, 1])[:, None] * unit
    blocked = (point + offset).norm(dim=1) < _CLEAR_M
    there = torch.where(blocked[:, None], point - offset, point + offset)
    low, high = _PROTOCOL.stand_m
    target = torch.cat((there, (half + low + (high - low) * u[:, 3])[:, None]), dim=1)
    return resting(start, facing, target)


def arranged(
    affordance: Affordance,
    pieces: list[Piece],
    what: Disturbance,
    point: Tensor,
    facing: Tensor,
    trials: NDArray[np.int64],
    seed: int,
    target_m: tuple[float, float],
) -> Furnished | Stacked:
    """The arrangement of what a task uses."""
    if affordance != "carry":
        return Furnished(pieces, affordance, what, point, facing)
    layout = stacked_layout(pieces, point, facing, trials, seed, target_m)
    return Stacked(pieces, what, layout, point, facing)


def sized(piece: Piece, scale: float) -> Piece:
    """A trial's piece at its scale; boxes have theirs already."""
    return piece if piece.category == "box" else scaled(piece, scale)


def stand(scenes: Scenes, origin: Tensor, yaw: Tensor) -> None:
    """Characters standing at the origin with heading 0, furniture about them."""
    every = torch.arange(scenes.n)
    qpos = torch.from_numpy(character.standing_qpos()).expand(scenes.n, -1)
    qvel = torch.zeros(scenes.n, character.NV, dtype=torch.float64)
    scenes.set_down(every, qpos, qvel, origin, yaw)
