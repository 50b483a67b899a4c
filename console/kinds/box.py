"""The carried box in the player, in recordings and in flags."""

import math
from collections.abc import Sequence

import numpy as np
import torch

from console.commands import Synthesize
from console.kinds.flags import numbers, within
from console.kinds.poses import HERE, tensors
from console.kinds.setup import Pose, Setup
from console.recording.format import Take
from policy.objects.box import MASSES_KG, SIZES_M
from rpc.v1 import policy_pb2 as pb
from world import rotations
from world.character import model as character
from world.config import CarryConfig
from world.errors import ConfigError
from world.furniture.piece import Piece
from world.objects.box_bank import BoxBank, resting
from world.scene import box as box_scene
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.scene.target import BoxState, Target
from world.tasks import Task

BOX = "box"
#: Heights of stands, m.
_STANDS_M = (0.05, 3.0)


class BoxKind:
    """The box kind; see Kind."""

    pictured = False
    flags: frozenset[str] = frozenset({"object", "scale", "to", "stand_m", "box_kg"})

    def played(
        self, setup: Setup, piece: Piece, task: Task, carry: CarryConfig, balls: Sequence[Ball]
    ) -> "PlayedBox":
        """See Kind."""
        return PlayedBox(setup, piece, carry, balls)

    def recorded(self, take: Take, task: Task) -> Target:
        """See Kind."""
        if not len(take.cargo) or not len(take.stand):
            raise ConfigError("the recording has no box")
        pose = torch.from_numpy(take.qpos[:, character.NQ : character.NQ + 7]).float()
        moving = torch.from_numpy(take.qvel[:, character.NV : character.NV + 3]).float()
        half = torch.from_numpy(take.cargo).float().expand(len(take), 3)
        up = torch.tensor([0.0, 0.0, float(take.cargo[2])])
        target = (torch.from_numpy(take.stand).float() + up).expand(len(take), 3)
        start = pose[:1, :3].expand(len(take), 3)
        rotation = rotations.normalise(pose[:, 3:])
        box = BoxState(pose[:, :3], rotation, moving, half, start, target)
        return Target(target, rotations.heading(rotation), box.corners(), target, box)

    def requested(
        self, command: Synthesize, task: Task, request: pb.SynthesizeRequest
    ) -> Piece | None:
        """See Kind."""
        request.box.CopyFrom(box_of(command))
        return None

    def shown(self, piece: Piece) -> Piece:
        """Return the stand under the box's initial position."""
        return box_scene.STAND


class PlayedBox:
    """A box on its stand, and the target stand, both of medium height; see Object."""

    def __init__(
        self, setup: Setup, piece: Piece, carry: CarryConfig, balls: Sequence[Ball]
    ) -> None:
        self._bank = BoxBank([piece], balls)
        self.model = self._bank.models[0]
        height = sum(carry.stand_m) / 2 + float(self._bank.half[0, 2])
        self._up = torch.tensor([[height]])
        box, facing = tensors(setup.box)
        goal, _ = tensors(setup.goal)
        self._layout = resting(
            torch.cat((box, self._up), dim=1), facing, torch.cat((goal, self._up), dim=1)
        )

    def begin(self, scenes: Scenes) -> None:
        """See Object."""
        self._bank.apply(scenes, HERE, HERE, self._layout)

    def move(self, scenes: Scenes, goal: Pose) -> None:
        """See Object."""
        self._layout.target[0, :2] = tensors(goal)[0][0]
        top = self._layout.target.clone()
        top[:, 2] -= self._bank.half[0, 2]
        scenes.move_stand(HERE, top)

    def target(self, scenes: Scenes) -> Target:
        """See Object."""
        return scenes.now(self._bank.target(HERE, self._layout))


def box_of(command: Synthesize) -> pb.CarriedBox:
    """Return the box of a command on its stand, with its target; ConfigError names a flag."""
    if command.object not in (None, BOX):
        raise ConfigError(f"--object {command.object}: the task is carry; give --object {BOX}")
    if command.to is None:
        raise ConfigError("--to X,Y,HEIGHT: give the target of the box (m; top of the stand)")
    size = command.scale * np.array(box_scene.BOX_SIZE_M)
    smallest, largest = SIZES_M[0] / size.min(), SIZES_M[1] / size.max()
    within("--scale", command.scale, (smallest * command.scale, largest * command.scale))
    x, y, yaw = numbers("--at", command.at, "X,Y,YAW (m, m, degrees)")
    to_x, to_y, height = numbers("--to", command.to, "X,Y,HEIGHT (m)")
    up = 0.5 * float(size[2])
    start = [x, y, within("--stand-m", command.stand_m, _STANDS_M) + up]
    half = 0.5 * math.radians(yaw)
    found = pb.CarriedBox(
        position=start,
        rotation=[math.cos(half), 0.0, 0.0, math.sin(half)],
        velocity=[0.0, 0.0, 0.0],
        size=size.tolist(),
        start=start,
        goal=[to_x, to_y, within("--to's HEIGHT", height, _STANDS_M) + up],
    )
    if command.box_kg is not None:
        found.mass_kg = within("--box-kg", command.box_kg, MASSES_KG)
    return found
