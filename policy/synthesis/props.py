"""What stands in a simulated scene beside the character: furniture, or a box on its stand."""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import mujoco
import numpy as np
import torch
from torch import Tensor

from policy.errors import RequestError
from policy.fields import Numbers, number
from policy.service.situations import SITUATION, place_of
from policy.synthesis.box import MASSES_KG, carried
from policy.synthesis.placement import (
    SCALES,
    Standing,
    fill_place,
    mesh_spot,
    placed,
    standing,
    turned,
)
from rpc.v1 import policy_pb2 as pb
from world.furniture.piece import Box, Piece
from world.meshes import importing
from world.meshes.build import Told
from world.objects.box_bank import BoxBank
from world.scene import box as box_scene
from world.scene.batch import Scenes
from world.scene.model import Ball, compile_scene
from world.tasks import Place, Task

_HERE = torch.zeros(1, dtype=torch.int64)
#: Mesh formats that arrive in one piece.
FORMATS = ("obj", "stl", "ply", "glb")


class Props(Protocol):
    """The object of one scene."""

    model: mujoco.MjModel

    def begin(self, scenes: Scenes) -> None:
        """Put everything where the request has it."""
        ...

    def place(self, scenes: Scenes) -> Place:
        """What the task must know of it now."""
        ...

    def move(self, scenes: Scenes, position: Numbers, yaw: float) -> None:
        """Put it elsewhere: furniture to position [3] m, or the box's first stand below it."""
        ...

    def spot(self) -> tuple[Tensor, Tensor]:
        """The floor below the place of use, or below the box's first place, [1, 2] m, and where it
        faces [1, 2] (cosine, sine)."""
        ...

    def shift(self, scenes: Scenes, point: Tensor, facing: Tensor) -> None:
        """Put it where its spot is point [1, 2] m and faces facing [1, 2]; a box on its first stand
        goes along with it."""
        ...

    def pose(self, scenes: Scenes) -> tuple[list[float], list[float]]:
        """Position [3] m and rotation [4] of the object, world."""
        ...

    def boxes(self) -> tuple[Box, ...]:
        """What it is made of, in its frame."""
        ...


def props_of(
    request: pb.SynthesizeRequest,
    task: Task,
    balls: Sequence[Ball] = (),
    piece: Piece | None = None,
    gone: Callable[[], bool] = lambda: False,
) -> Props:
    """The object of a request; RequestError names what is missing or wrong.

    balls: projectiles that its scene has besides. piece: the furniture, at its scale, in the place
    of the request's shape. gone: whether nobody waits for it any more.
    """
    if task.affordance == "carry":
        if not request.HasField("box"):
            raise RequestError(f"box: missing, '{task.name}' needs it")
        return Boxed(request.box, balls)
    if not request.HasField("furniture"):
        raise RequestError(f"furniture: missing, '{task.name}' needs it")
    if piece is None and request.furniture.WhichOneof("shape") == "mesh":
        piece = piece_of_mesh(request.furniture, gone)
    if piece is not None:
        where = placed(request.furniture, piece, mesh_spot(piece, request.furniture, task), True)
    else:
        where = standing(request.furniture, task, anywhere=True)
    return Furnished(where, task, balls)


def piece_of_mesh(furniture: pb.Furniture, gone: Callable[[], bool] = lambda: False) -> Piece:
    """The piece that a mesh gives, made in a process of its own within bounds, or known already."""
    mesh = furniture.mesh
    if mesh.format not in FORMATS:
        raise RequestError(
            f"furniture.mesh.format: '{mesh.format}', must be one of {', '.join(FORMATS)}"
        )
    scale = number(furniture.scale if furniture.HasField("scale") else 1.0, "scale", *SCALES)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"mesh.{mesh.format}"
        path.write_bytes(mesh.data)
        (outcome,) = importing.run(importing.jobs([path], Told()), 1, stopped=gone)
    piece = outcome.piece()
    if piece is None:
        raise RequestError(f"furniture.mesh: {outcome.refused}")
    return piece.scaled(scale)


class Furnished:
    """Furniture to sit or lie on."""

    def __init__(self, where: Standing, task: Task, balls: Sequence[Ball] = ()) -> None:
        self._where, self._task = where, task
        self._row = torch.zeros(1, SITUATION)
        try:
            self.model = compile_scene(where.piece, balls)
        except ValueError as error:  # MuJoCo's own word on a model that it does not take
            raise RequestError(f"furniture: cannot be simulated: {error}") from error

    def begin(self, scenes: Scenes) -> None:
        """See Props."""
        self.move(scenes, self._where.position, self._where.yaw)

    def place(self, scenes: Scenes) -> Place:
        """See Props."""
        return place_of(self._row, self._task)

    def move(self, scenes: Scenes, position: Numbers, yaw: float) -> None:
        """See Props."""
        self._where = self._where.moved(position, yaw)
        row = np.zeros(SITUATION)
        fill_place(row, self._where)
        self._row = torch.from_numpy(row).float()[None]
        turned = torch.tensor([[np.cos(yaw), np.sin(yaw)]])
        scenes.move_furniture(_HERE, torch.from_numpy(position)[None], turned)

    def spot(self) -> tuple[Tensor, Tensor]:
        """See Props."""
        heading = self._where.yaw + self._where.spot.facing_rad
        point = self._where.position + turned(self._where.spot.point_m, self._where.yaw)
        facing = torch.tensor([[np.cos(heading), np.sin(heading)]], dtype=torch.float32)
        return torch.from_numpy(point[:2]).float()[None], facing

    def shift(self, scenes: Scenes, point: Tensor, facing: Tensor) -> None:
        """See Props."""
        cos, sin = facing[0].double().tolist()
        yaw = float(np.arctan2(sin, cos)) - self._where.spot.facing_rad
        origin = np.append(point[0].double().numpy(), 0.0)
        origin = origin - turned(self._where.spot.point_m, yaw)
        origin[2] = self._where.position[2]
        self.move(scenes, origin, yaw)

    def pose(self, scenes: Scenes) -> tuple[list[float], list[float]]:
        """See Props."""
        half = 0.5 * self._where.yaw
        rotation = [float(np.cos(half)), 0.0, 0.0, float(np.sin(half))]
        return self._where.position.tolist(), rotation

    def boxes(self) -> tuple[Box, ...]:
        """See Props."""
        return self._where.piece.boxes


class Boxed:
    """A box to carry, on a stand, and the stand to bring it to."""

    def __init__(self, message: pb.CarriedBox, balls: Sequence[Ball] = ()) -> None:
        size, layout = carried(message)
        mass = None
        if message.HasField("mass_kg"):
            mass = number(message.mass_kg, "box.mass_kg", *MASSES_KG)
        else:
            mass = box_scene.BOX_KG * float(np.prod(size)) / float(np.prod(box_scene.BOX_SIZE_M))
        x, y, z = (0.5 * float(edge) for edge in size)
        piece = Piece("box", "box", (Box((0.0, 0.0, 0.0), (x, y, z)),), (), mass)
        self._bank, self._layout = BoxBank([piece], balls), layout
        self.model = self._bank.models[0]

    def begin(self, scenes: Scenes) -> None:
        """See Props."""
        self._bank.put(scenes, _HERE, _HERE, self._layout)

    def place(self, scenes: Scenes) -> Place:
        """See Props."""
        return scenes.now(self._bank.place(_HERE, self._layout))

    def move(self, scenes: Scenes, position: Numbers, yaw: float) -> None:
        """See Props."""
        turned = torch.tensor([[np.cos(yaw), np.sin(yaw)]])
        scenes.move_furniture(_HERE, torch.from_numpy(position)[None], turned)

    def spot(self) -> tuple[Tensor, Tensor]:
        """See Props."""
        return self._layout.start[:, :2], self._layout.start_yaw

    def shift(self, scenes: Scenes, point: Tensor, facing: Tensor) -> None:
        """See Props."""
        self._layout = self._bank.shift(scenes, _HERE, _HERE, self._layout, point, facing)

    def pose(self, scenes: Scenes) -> tuple[list[float], list[float]]:
        """See Props."""
        pose: Tensor = scenes.free_qpos[0, :7]
        return pose[:3].tolist(), pose[3:].tolist()

    def boxes(self) -> tuple[Box, ...]:
        """See Props."""
        return self._bank.pieces[0].boxes
