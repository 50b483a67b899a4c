"""The bank of tracking scenes: each clip with its box, seat or bed."""

import copy
from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
import torch

from world.config import TrackConfig
from world.errors import ClipError, ConfigError
from world.furniture.piece import Box, Piece
from world.motions.clip import Clip
from world.scene import box as box_scene
from world.scene import slots
from world.scene.box import STAND
from world.scene.model import Ball, compile_scene
from world.tracking.arrivals import Arrivals
from world.tracking.reference import Reference
from world.tracking.rollouts import Rollouts
from world.tracking.support import sunk_m, supports

#: Upper bound of the lift of an initial state out of its seat or bed, m.
_LIFT_M = 0.06
_GOLDEN = 0.6180339887498949


class TrackBank:
    """V = C × K models: each of C clips with K boxes of different size, mass and friction; the
    first K belong to clip 0. Without any box, K is 1."""

    def __init__(
        self,
        clips: Sequence[Clip],
        reference: Reference,
        config: TrackConfig,
        balls: Sequence[Ball] = (),
    ) -> None:
        """Raises ConfigError for an empty range of sizes, weights or frictions."""
        self.has_box = bool(reference.boxed.any())
        self.each = _checked(config) if self.has_box else 1
        self.reference = reference
        holding = supports(clips)
        shared = slots.common([found.piece for found in holding])
        # stands are ours: who was recorded walked where one would be in the way. Beside seats and
        # beds they stay solid, as a simulator of all scenes at once has one setting for all.
        passable = not config.solid and all(found.piece is STAND for found in holding)
        #: Position of the support's origin, m [C, 3], and its yaw (cosine, sine) [C, 2].
        self.origin = torch.tensor([found.origin_m for found in holding], dtype=torch.float32)
        yaw = torch.tensor([found.yaw_rad for found in holding], dtype=torch.float32)
        self.yaw = torch.stack((torch.cos(yaw), torch.sin(yaw)), dim=1)
        self.point = torch.tensor([found.point_m for found in holding], dtype=torch.float32)
        self.head = torch.tensor([found.head_m for found in holding], dtype=torch.float32)
        self.corners = torch.stack(
            [torch.from_numpy(found.piece.corners()).to(torch.float32) for found in holding]
        )
        #: Lift of the initial state in each frame, m [F], out of its support.
        lift = [sunk_m(clip, found) for clip, found in zip(clips, holding, strict=True)]
        self.lift = torch.from_numpy(np.concatenate(lift)).to(torch.float32).clamp_max(_LIFT_M)
        self.models: list[mujoco.MjModel] = []
        pieces, half, mass = [], [], []
        for number, found in enumerate(holding):
            for k in range(self.each):
                share = (number * self.each + k) * _GOLDEN % 1.0
                cargo, friction = _cargo(reference, number, k, share, config, self.each)
                boxed = bool(reference.boxed[number])
                pieces.append(cargo if boxed else found.piece)
                half.append(cargo.boxes[0].half_m)
                mass.append(cargo.mass_kg)
                if k and not boxed:  # an unused box need not vary
                    self.models.append(self.models[-1])
                    continue
                model = compile_scene(
                    found.piece,
                    balls,
                    cargo if self.has_box else None,
                    shared=shared,
                    passable=passable,
                )
                if self.has_box:
                    model.geom(box_scene.BOX_BODY).friction[0] = friction
                self.models.append(model)
        self.pieces = tuple(pieces)
        self.half = torch.tensor(half, dtype=torch.float32)
        self.mass = torch.tensor(mass, dtype=torch.float32)

        self.arrivals: Arrivals | None = None
        self.rollouts: Rollouts | None = None

    def __len__(self) -> int:
        return len(self.models)

    def starting_in(self, chosen: Sequence[bool]) -> "TrackBank":
        """Return this bank with initial states in the chosen clips alone; ClipError where none of
        these has one."""
        weight = self.reference.start_weight
        some = torch.tensor(chosen, device=weight.device)[self.reference.clip]
        weight = torch.where(some, weight, 0.0)
        if not bool((weight > 0.0).any()):
            raise ClipError("no clip has the object of the task whose goal is shown: add clips")
        found = copy.copy(self)
        found.reference = replace(self.reference, start_weight=weight)
        return found

    def joined_from(
        self, arrivals: Arrivals | None, rollouts: Rollouts | None = None
    ) -> "TrackBank":
        """Return this bank, of whose pick-ups some begin in the states of `arrivals`, and of whose
        clips some in those of `rollouts`."""
        found = copy.copy(self)
        found.arrivals, found.rollouts = arrivals, rollouts
        return found


def _checked(config: TrackConfig) -> int:
    ranges = {
        "size": config.size,
        "weight-kg": config.weight_kg,
        "friction": config.friction,
    }
    for name, (low, high) in ranges.items():
        if not 0.0 < low <= high:
            raise ConfigError(
                f"track.{name} {low} {high}: choose numbers above 0, the smaller first"
            )
    if config.boxes < 1:
        raise ConfigError(f"track.boxes {config.boxes}: choose 1 or more")
    return config.boxes


def _cargo(
    reference: Reference, clip: int, k: int, share: float, config: TrackConfig, each: int
) -> tuple[Piece, float]:
    """Return the k-th box of a clip and its friction: sizes are spaced evenly over the range,
    masses and frictions by `share` in [0, 1), independently of the sizes."""

    def between(span: tuple[float, float], at: float) -> float:
        return span[0] + (span[1] - span[0]) * at

    edges = reference.size[clip] if bool(reference.boxed[clip]) else torch.full((3,), 0.3)
    scale = between(config.size, (k + 0.5) / each)
    x, y, z = (0.5 * scale * edge for edge in edges.tolist())
    piece = Piece(
        "box",
        "box",
        (Box((0.0, 0.0, 0.0), (x, y, z)),),
        (),
        box_scene.by_volume_kg((x, y, z)) if config.by_volume else between(config.weight_kg, share),
    )
    return piece, between(config.friction, (3.0 * share) % 1.0)
