"""What the flags of `inhabit synthesize` say of a scene: a request, and a piece that it cannot
name."""

import math

from console.commands import Synthesize
from console.kinds import kind
from console.kinds.flags import numbers, within
from console.synthesis.motion import MOST_S
from rpc.v1 import policy_pb2 as pb
from world.character import model as character
from world.furniture.piece import Piece
from world.tasks import Task


def scene(
    command: Synthesize, task: Task, seed: int | None
) -> tuple[pb.SynthesizeRequest, Piece | None]:
    """The request of a command for a policy of `task`, and its furniture at its scale (None: a
    box).

    seed: of the actions; None: their means. Raises ConfigError, which names the flag, and
    PieceError for a piece that cannot be used.
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
    return request, kind(task).requested(command, task, request)
