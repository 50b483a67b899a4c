"""Disturbances of a simulated character: pushes, thrown balls and moved furniture."""

from dataclasses import replace

import torch

from policy.errors import RequestError
from policy.fields import Numbers, number, upright, vector
from policy.objects import Props
from rpc.v1 import policy_pb2 as pb
from world.character import model as character
from world.character.features import Body
from world.scene import perturbations
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.scene.perturbations import Disturbance, Mover, Moving, Thrower, Throwing

_MAX_FORCE_N = 1e4
_STEP_S = 1.0 / character.CONTROL_HZ
#: Bounds of balls: number, masses (kg), radii (m) and speeds (m/s; a faster ball would pass through
#: a limb between two substeps).
_MOST_BALLS, _MASSES_KG, _RADII_M, _SPEEDS_M_S = 200, (0.01, 20.0), (0.02, 0.3), (1.0, 20.0)
#: Bounds of a displacement, m: distance of the character that triggers it, and its length.
_NEAR_M, _SHIFTS_M = (0.0, 100.0), (0.01, 10.0)


def thrown(message: pb.SynthesizeRequest, steps: int) -> Disturbance | None:
    """Thrown balls of a request of `steps` control steps; None without any."""
    if not message.HasField("projectiles"):
        return None
    given, how = message.projectiles, Throwing()

    def chosen(field: str, default: float, bounds: tuple[float, float]) -> float:
        value = getattr(given, field) if given.HasField(field) else default
        return number(value, f"projectiles.{field}", *bounds)

    most = min(_MOST_BALLS, steps)
    count = int(chosen("count", min(how.count, most), (1, most)))
    ball = Ball(
        chosen("mass_kg", how.ball.mass_kg, _MASSES_KG),
        chosen("radius_m", how.ball.radius_m, _RADII_M),
    )
    throwing = Throwing(
        count,
        ball,
        chosen("speed_m_s", how.speed_m_s, _SPEEDS_M_S),
        flying=min(how.flying, count),
    )
    return perturbations.draw("projectiles", 1, _signed(given.seed), steps, throwing)


def displaced(message: pb.SynthesizeRequest) -> Disturbance | None:
    """Displacement of the furniture in a request; None without one."""
    if not message.HasField("displacement"):
        return None
    given, how = message.displacement, Moving()
    if message.moves:
        raise RequestError("displacement: not together with moves, choose one of them")
    if given.HasField("near_m"):
        near_m = number(given.near_m, "displacement.near_m", *_NEAR_M)
        how = replace(how, near_m=(near_m, near_m))
    if given.HasField("shift_m"):
        shift_m = number(given.shift_m, "displacement.shift_m", *_SHIFTS_M)
        how = replace(how, shift_m=(shift_m, shift_m))
    return replace(perturbations.draw("moved", 1, _signed(given.seed), 0), moving=how)


def balls_of(what: Disturbance | None) -> tuple[Ball, ...]:
    """Balls that the scene must contain for a disturbance."""
    return () if what is None else what.balls()


class Disturbances:
    """Schedule of all disturbances of one scene."""

    def __init__(
        self,
        request: pb.SynthesizeRequest,
        props: Props,
        scenes: Scenes,
        throws: Disturbance | None,
        displacement: Disturbance | None,
    ) -> None:
        """Schedule for a scene in its initial state; RequestError names a wrong field."""
        self._props, self._scenes = props, scenes
        self._moves, self._pushes = _moves(request), _pushes(request)
        self._force = scenes.batch.bind("xfrc_applied")
        self._throws = throws
        self._thrower = None if throws is None else Thrower(throws, scenes)
        self._mover = None if displacement is None else Mover(displacement, *props.use_point())
        self.balls_thrown = 0

    @property
    def moved(self) -> bool:
        """Whether the displacement has begun."""
        return self._mover is not None and bool(self._mover.elapsed_s[0] >= 0)

    def balls(self) -> torch.Tensor:
        """Positions of the balls [balls, 3], m, world; NaN for those out of the scene."""
        return torch.zeros(0, 3) if self._thrower is None else self._thrower.position[0]

    def step(self, step: int, body: Body) -> None:
        """Apply what is due before control step `step`: moves, throws and forces."""
        time_s = step * _STEP_S + 1e-9
        while self._moves and self._moves[0][0] <= time_s:
            _, position, yaw = self._moves.pop(0)
            self._props.move(self._scenes, position, yaw)
        self._force[0] = 0.0
        for from_s, to_s, number_, force in self._pushes:
            if from_s <= time_s < to_s:
                self._force[0, number_, :3] += force
        if self._thrower is not None and self._throws is not None:
            self._thrower.step(step, body, _STEP_S)
            self.balls_thrown += int((self._throws.step == step).sum())
        if self._mover is not None and (now := self._mover.step(body, _STEP_S)) is not None:
            self._props.shift(self._scenes, now[1], now[2])


def _moves(request: pb.SynthesizeRequest) -> list[tuple[float, Numbers, float]]:
    """(time s, position, yaw) of the furniture's moves, in order."""
    return sorted(
        (
            (
                number(move.at_s, f"moves[{i}].at_s", 0.0, 1e4),
                vector(move.position, f"moves[{i}].position", 3),
                upright(move.rotation, f"moves[{i}].rotation"),
            )
            for i, move in enumerate(request.moves)
        ),
        key=lambda move: move[0],
    )


def _pushes(request: pb.SynthesizeRequest) -> list[tuple[float, float, int, Numbers]]:
    """(from s, to s, body id in the model, force N) of the pushes."""
    found = []
    for i, push in enumerate(request.pushes):
        if push.body not in character.BODIES:
            raise RequestError(
                f"pushes[{i}].body: '{push.body}', must be one of {', '.join(character.BODIES)}"
            )
        begin = number(push.at_s, f"pushes[{i}].at_s", 0.0, 1e4)
        length = number(push.seconds, f"pushes[{i}].seconds", 0.0, 60.0)
        force = vector(push.force, f"pushes[{i}].force", 3, _MAX_FORCE_N)
        # body 0 of the model is the world
        found.append((begin, begin + length, 1 + character.BODIES.index(push.body), force))
    return found


def _signed(seed: int) -> int:
    """The signed 64-bit integer of an unsigned seed, as the random streams take it."""
    return seed - (1 << 64) if seed >= 1 << 63 else seed
