"""A bank of scenes with a box to carry, and the layouts of boxes and stands."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import torch
from torch import Tensor

from world import rotations
from world.config import CarryConfig
from world.errors import ConfigError, PieceError
from world.furniture.piece import Piece
from world.scene import box as box_scene
from world.scene.batch import Scenes
from world.scene.model import Ball, compile_scene
from world.scene.target import BoxState, Target

#: A box rests on its initial stand, and moves with it, while its centre is this near to its start,
#: m.
_ON_STAND_M = 0.1


@dataclass(frozen=True)
class Layout:
    """Boxes of m scenes with their stands and targets; world, m."""

    position: Tensor
    """[m, 3]: the box's centre."""
    rotation: Tensor
    """[m, 4]: unit quaternion w, x, y, z."""
    velocity: Tensor
    """[m, 6]: of the centre, m/s, and angular, in the box's own axes, rad/s."""
    start: Tensor
    """[m, 3]: the box's centre on the initial stand."""
    start_yaw: Tensor
    """[m, 2]: cosine and sine of the initial stand's yaw."""
    target: Tensor
    """[m, 3]: target of the centre."""

    def rows(self, ids: Tensor) -> "Layout":
        """The scenes of the given indices."""
        return Layout(
            self.position[ids],
            self.rotation[ids],
            self.velocity[ids],
            self.start[ids],
            self.start_yaw[ids],
            self.target[ids],
        )


def resting(position: Tensor, yaw: Tensor, target: Tensor) -> Layout:
    """Layout of boxes at rest: centres [m, 3], yaw [m, 2] (cosine, sine), targets [m, 3]."""
    rotation = rotations.from_heading(yaw)
    return Layout(position, rotation, position.new_zeros(len(position), 6), position, yaw, target)


class BoxBank:
    """V boxes, each of a size and a mass, with the models of their scenes; an ObjectBank."""

    def __init__(self, boxes: Sequence[Piece], balls: Sequence[Ball] = ()) -> None:
        """balls: projectiles of every scene.

        Raises PieceError without boxes, and for a piece that is no box.
        """
        if not boxes:
            raise PieceError("no boxes: choose at least one")
        for piece in boxes:
            if not box_scene.is_box(piece):
                raise PieceError(f"{piece.name}: is no box to carry")
        self.pieces = tuple(boxes)
        self.models: list[mujoco.MjModel] = [
            compile_scene(box_scene.STAND, balls, piece) for piece in boxes
        ]
        self.half = torch.tensor([piece.boxes[0].half_m for piece in boxes], dtype=torch.float32)
        self.mass = torch.tensor([piece.mass_kg for piece in boxes], dtype=torch.float32)
        self._by_width = torch.argsort(self.half[:, 1])

    def __len__(self) -> int:
        return len(self.models)

    def of_width(self, width_m: Tensor, u: Tensor) -> Tensor:
        """Variants [n] whose long side, between the hands, is about width_m [n]: one of the three
        nearest, chosen by u [n] in [0, 1)."""
        order = self._by_width
        window = min(3, len(order))
        widths = (2.0 * self.half[order, 1]).contiguous()
        at = torch.searchsorted(widths, width_m.contiguous())
        first = (at - 1).clamp(0, len(order) - window)
        return order[first + (u * window).long().clamp_max(window - 1)]

    def apply(self, scenes: Scenes, ids: Tensor, variant: Tensor, layout: Layout) -> None:
        """Write the layout of the boxes `variant` [m] and their stands into the scenes `ids`
        [m]."""
        down = torch.zeros_like(layout.start)
        down[:, 2] = self.half[variant, 2]
        scenes.move_furniture(ids, layout.start - down, layout.start_yaw)
        scenes.move_stand(ids, layout.target - down)
        pose = torch.cat((layout.position, layout.rotation), dim=1)
        scenes.set_free(ids, 0, pose, layout.velocity)

    def shift(
        self,
        scenes: Scenes,
        ids: Tensor,
        variant: Tensor,
        layout: Layout,
        point: Tensor,
        facing: Tensor,
    ) -> Layout:
        """Move the initial stands of the scenes `ids` [m] to floor points [m, 2] with yaws facing
        [m, 2] (cosine, sine), with the boxes `variant` [m] that rest on them; returns the new
        layout [m]."""
        start = torch.cat((point, layout.start[:, 2:]), dim=1)
        down = torch.zeros_like(start)
        down[:, 2] = self.half[variant, 2]
        scenes.move_furniture(ids, start - down, facing)
        pose = scenes.free_qpos[ids, :7].float()
        on_it = (pose[:, :3] - layout.start).norm(dim=1) < _ON_STAND_M
        moved = resting(start, facing, layout.target)
        still = torch.cat((moved.position, moved.rotation), dim=1)[on_it]
        scenes.set_free(ids[on_it], 0, still, moved.velocity[on_it])
        return moved

    def move(
        self,
        scenes: Scenes,
        ids: Tensor,
        variant: Tensor,
        target: Target,
        point: Tensor,
        facing: Tensor,
    ) -> Target:
        """See MovableBank: moves the initial stands with the boxes that rest on them."""
        box = target.box
        assert box is not None, "the targets of a bank of boxes have boxes"
        velocity = torch.cat((box.velocity, torch.zeros_like(box.velocity)), dim=1)
        pose = box.position, box.rotation, velocity
        layout = Layout(*pose, box.start, facing, box.target)
        moved = self.shift(scenes, ids, variant, layout, point, facing)
        return scenes.now(self.target(variant, moved), ids)

    def target(self, variant: Tensor, layout: Layout) -> Target:
        """Targets of the boxes `variant` [m]; the use point is the target of the box."""
        state = BoxState(
            layout.position,
            layout.rotation,
            layout.velocity[:, :3],
            self.half[variant],
            layout.start,
            layout.target,
        )
        facing = rotations.heading(layout.rotation)
        return Target(layout.target, facing, state.corners(), layout.target, state)


def boxes(config: CarryConfig) -> tuple[Piece, ...]:
    """The training boxes of a configuration: sizes evenly over its scales. A configured range of
    masses is spread by the golden ratio, so that size and mass are independent.

    Raises ConfigError for an empty range.
    """
    low, high = config.scale
    if not 0.0 < low <= high or config.sizes < 1:
        raise ConfigError(f"carry.scale {low} {high}: choose sizes above 0, the smaller first")
    found = []
    for index in range(config.sizes):
        scale = low + (high - low) * (index + 0.5) / config.sizes
        mass = None
        if config.weight_kg is not None:
            lightest, heaviest = config.weight_kg
            if not 0.0 < lightest <= heaviest:
                raise ConfigError(
                    f"carry.weight-kg {lightest} {heaviest}: choose weights above 0 kg, the "
                    "lighter first"
                )
            fraction = (index * 0.6180339887498949) % 1.0
            mass = lightest + (heaviest - lightest) * fraction
        found.append(box_scene.box(scale, mass))
    return tuple(found)
