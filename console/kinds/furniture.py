"""Furniture in the player, in recordings and in flags."""

import difflib
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from console.commands import Synthesize
from console.kinds.flags import numbers, within
from console.kinds.poses import HERE, tensors
from console.kinds.setup import Pose, Setup
from console.recording.format import Take, boxes_of
from policy.objects.placement import SCALES
from rpc.v1 import policy_pb2 as pb
from world import rotations
from world.config import CarryConfig
from world.errors import ConfigError, InhabitError, PieceError
from world.furniture import catalogue
from world.furniture.bands import SPLITS
from world.furniture.piece import Piece
from world.furniture.usage import use_points
from world.meshes import importing, source, store
from world.meshes.build import ImportOptions
from world.objects.furniture_bank import FurnitureBank, scaled
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.scene.target import Target
from world.tasks import Task

_NEAREST = 3


class FurnitureKind:
    """The furniture kind; see Kind."""

    pictured = True
    flags: frozenset[str] = frozenset({"object", "place", "scale"})

    def played(
        self, setup: Setup, piece: Piece, task: Task, carry: CarryConfig, balls: Sequence[Ball]
    ) -> "PlayedFurniture":
        """See Kind."""
        return PlayedFurniture(setup, piece, task.affordance.name, balls)

    def recorded(self, take: Take, task: Task) -> Target:
        """See Kind."""
        piece = scaled(catalogue.find(take.piece), take.scale)
        rows = boxes_of(piece)
        if rows.shape != take.boxes.shape or not np.allclose(rows, take.boxes, atol=1e-6):
            raise ConfigError(f"'{take.piece}' differs from the catalogue's piece of that name")
        if task.affordance.use_point_count(piece) > 1:
            raise ConfigError("a recording lacks the side of the bed that is the target")
        bank = FurnitureBank([piece], task.affordance.name)
        origin = torch.from_numpy(take.mocap_pos).float()
        yaw = rotations.heading(torch.from_numpy(take.mocap_quat).float())
        every = torch.zeros(len(take), dtype=torch.int64)
        facing = rotations.turn(yaw, bank.facing[every])
        point = origin[:, :2] + rotations.turn(yaw, bank.point[every, :2])
        return bank.target(every, point, facing)

    def requested(
        self, command: Synthesize, task: Task, request: pb.SynthesizeRequest
    ) -> Piece | None:
        """See Kind."""
        scale = within("--scale", command.scale, SCALES)
        piece = piece_of(named(command)).scaled(scale)
        count = task.affordance.use_point_count(piece)
        if not 0 <= command.place < count:
            choices = "0, the only one" if count == 1 else f"0 to {count - 1}"
            raise ConfigError(
                f"--place {command.place}: {piece.name} has {count} use"
                f" point{'s' * (count != 1)} to {task.affordance.name}; choose {choices}"
            )
        x, y, yaw = numbers("--at", command.at, "X,Y,YAW (m, m, degrees)")
        half = 0.5 * math.radians(yaw)
        request.furniture.CopyFrom(
            pb.Furniture(
                position=[x, y, 0.0],
                rotation=[math.cos(half), 0.0, 0.0, math.sin(half)],
                scale=scale,
                place=command.place,
            )
        )
        return piece

    def shown(self, piece: Piece) -> Piece:
        """See Kind."""
        return piece


def named(command: Synthesize) -> str:
    """Return the value of --object; ConfigError without it."""
    if command.object is None:
        raise ConfigError("--object: name a piece of furniture (inhabit objects list)")
    return command.object


class PlayedFurniture:
    """A piece of furniture, placed by its use point; see Object."""

    def __init__(self, setup: Setup, piece: Piece, affordance: str, balls: Sequence[Ball]) -> None:
        # the variants of a bank have the use points of a piece in turn
        count = min(setup.side + 1, len(use_points(piece, affordance)))
        self._bank = FurnitureBank([piece] * count, affordance, balls)
        self._variant = torch.tensor([count - 1])
        self.model = self._bank.models[-1]
        self._goal = setup.goal

    def begin(self, scenes: Scenes) -> None:
        """See Object."""
        self.move(scenes, self._goal)

    def move(self, scenes: Scenes, goal: Pose) -> None:
        """See Object."""
        self._goal = goal
        scenes.move_furniture(HERE, *self._bank.placed(self._variant, *tensors(goal)))

    def target(self, scenes: Scenes) -> Target:
        """See Object."""
        return self._bank.target(self._variant, *tensors(self._goal))


def piece_of(word: str) -> Piece:
    """Return the furniture of a word: a piece of the catalogue by name, the file of an imported
    piece, or a mesh, which is imported.

    Raises ConfigError with the nearest names for an unknown name, PieceError for a file without a
    valid piece.
    """
    path = Path(word)
    if word.endswith(store.SUFFIX):
        return store.read(path)
    if path.suffix.lower() in source.SUFFIXES:
        return _imported(path)
    try:
        return catalogue.find(word)
    except InhabitError:
        if path.exists():
            raise PieceError(
                f"--object {word}: no piece; give a {store.SUFFIX} of inhabit objects import, or a "
                f"mesh ({', '.join(source.SUFFIXES)})"
            ) from None
        raise ConfigError(
            f"--object {word}: no such piece; the nearest names are {', '.join(nearest(word))} (or "
            f"give a {store.SUFFIX} or a mesh)"
        ) from None


def nearest(word: str) -> list[str]:
    """Return the names of the catalogue that are nearest to a word."""
    names = [
        f"{category}-{split}-{index:03d}"
        for category in catalogue.REGISTRY
        for split in SPLITS
        for index in range(catalogue.WHOLE[split] // len(catalogue.REGISTRY))
    ]
    return difflib.get_close_matches(word, names, _NEAREST, 0.0)


def _imported(path: Path) -> Piece:
    work = importing.jobs([path], ImportOptions())
    (outcome,) = importing.run(work, 1)
    piece = outcome.piece()
    if piece is None:
        raise PieceError(f"--object {path}: {outcome.refused}")
    return piece
