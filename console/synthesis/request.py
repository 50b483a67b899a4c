"""The flags of `inhabit synthesize` as a request of the policy service, and its furniture."""

import dataclasses
import math

import torch

from console.commands import Synthesize
from console.kinds import kind
from console.kinds.flags import numbers, within
from console.kinds.kind import OBJECT_FLAGS
from console.synthesis.motion import MOST_S
from rpc.v1 import policy_pb2 as pb
from world import rotations
from world.character import model as character
from world.errors import ConfigError
from world.furniture.piece import Piece
from world.objects import clearance
from world.objects.furniture_bank import FurnitureBank
from world.tasks import Task

#: The character is in a piece where its shapes, as spheres, overlap it by more, m.
_TOLERATED_M = 0.02


def scene(
    command: Synthesize, task: Task, seed: int | None
) -> tuple[pb.SynthesizeRequest, Piece | None]:
    """Return the request of a command for a policy of `task`, and its scaled furniture or None.

    seed: of the actions; None: mean actions. Raises ConfigError, which names the flag, also for a
    start within the piece, and PieceError for an unusable piece.
    """
    seconds = within("--seconds", command.seconds, (1.0 / character.CONTROL_HZ, MOST_S))
    x, y, yaw = numbers("--start", command.start, "X,Y,YAW (m, m, degrees)")
    request = pb.SynthesizeRequest(
        task=task.name, seconds=seconds, seed=seed, to_the_end=command.to_the_end
    )
    request.start.standing.CopyFrom(pb.Stance(x=x, y=y, yaw_rad=math.radians(yaw)))
    of_perturbation = command.seed or 0
    if command.perturb == "projectiles":
        request.projectiles.CopyFrom(pb.Projectiles(seed=of_perturbation))
    if command.perturb == "moved":
        request.displacement.CopyFrom(pb.Displacement(seed=of_perturbation))
    of_object = kind(task)
    for field in dataclasses.fields(command):
        value = getattr(command, field.name)
        if field.name in set(OBJECT_FLAGS) - of_object.flags and value != field.default:
            flag = f"--{field.name.replace('_', '-')} {value}"
            raise ConfigError(f"{flag}: the task {task.name} uses none; leave it out")
    piece = of_object.requested(command, task, request)
    if piece is not None:
        _require_outside(command, request, piece, task.affordance.name)
    return request, piece


def _require_outside(
    command: Synthesize, request: pb.SynthesizeRequest, piece: Piece, affordance: str
) -> None:
    """Raise ConfigError where the character would stand in the piece, which throws it out."""
    bank, stance = FurnitureBank([piece], affordance), request.start.standing
    half, quat = 0.5 * stance.yaw_rad, torch.tensor([list(request.furniture.rotation)])
    qpos = torch.from_numpy(character.standing_qpos())[None].float()
    qpos[0, :2] += torch.tensor([stance.x, stance.y])
    qpos[0, 3:7] = torch.tensor([math.cos(half), 0.0, 0.0, math.sin(half)])
    origin, yaw = torch.tensor([list(request.furniture.position)]), rotations.heading(quat)
    here = torch.zeros(1, dtype=torch.int64)
    deep = clearance.depth(clearance.points(qpos), origin, yaw, bank, here)
    if float(deep) <= _TOLERATED_M:
        return
    low, high = piece.bounds()
    corners = torch.tensor([(x, y) for x in (low[0], high[0]) for y in (low[1], high[1])])
    ends = rotations.turn(yaw, corners.float()) + origin[:, :2]
    (x0, y0), (x1, y1) = ends.amin(dim=0).tolist(), ends.amax(dim=0).tolist()
    raise ConfigError(
        f"--start {command.start}: the character would stand in {piece.name}, which reaches from"
        f" {x0:.2f} to {x1:.2f} m in X and from {y0:.2f} to {y1:.2f} m in Y: choose a point outside"
    )
