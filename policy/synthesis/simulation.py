"""One scene simulated for a client: object, initial state, disturbances and frames."""

from collections.abc import Callable, Iterator

import numpy as np
import torch
from torch import Tensor

from policy.checkpoints.served import Served
from policy.fields import Numbers, number
from policy.messages.requests import coordinates, noise
from policy.objects import props_of
from policy.synthesis.disturbances import Disturbances, balls_of, displaced, thrown
from rpc.v1 import policy_pb2 as pb
from world import rotations
from world.character import kinematics
from world.character import model as character
from world.character.features import Body
from world.errors import InhabitError
from world.furniture.piece import Piece
from world.scene.batch import Scenes
from world.scene.target import Target, state

#: Height of a standing initial state above the floor, m.
_LIFT_M = 0.002
DEFAULT_S = 20.0


class UnstableError(InhabitError):
    """The state of a simulation became non-finite."""


class Simulation:
    """Simulation of one Synthesize request; not thread-safe."""

    def __init__(
        self,
        request: pb.SynthesizeRequest,
        served: Served,
        max_s: float,
        piece: Piece | None = None,
        cancelled: Callable[[], bool] = lambda: False,
    ) -> None:
        """Compile the scene and set its initial state.

        piece: furniture, at its scale, used instead of the request's shape. cancelled: returns
        whether the client has cancelled the call; polled while a mesh is decomposed.
        Raises RequestError, naming the field, for what cannot be simulated.
        """
        self._served, self._task = served, served.task
        seconds = request.seconds if request.HasField("seconds") else DEFAULT_S
        self.steps = round(
            number(seconds, "seconds", 1.0 / character.CONTROL_HZ, max_s) * character.CONTROL_HZ
        )
        self._to_the_end, self._with_bodies = request.to_the_end, request.bodies
        self._seed = request.seed if request.HasField("seed") else None
        throws, displacement = thrown(request, self.steps), displaced(request)
        self.balls = balls_of(throws)
        self.props = props_of(request, self._task, self.balls, piece, cancelled)
        world = served.world
        self.scenes = Scenes([self.props.model], world.action_scale, world.action_clip)
        qpos, qvel = _start(request.start)
        here = torch.zeros(1, dtype=torch.int64)
        self.scenes.set_state(
            here,
            torch.from_numpy(qpos)[None],
            torch.from_numpy(qvel)[None],
            torch.zeros(1, 3),
            torch.tensor([[1.0, 0.0]]),
        )
        self._weights = torch.tensor(list(self._task.terms.values()))
        self._hold = round(world.hold_s * character.CONTROL_HZ)
        self.props.begin(self.scenes)
        self.disturbances = Disturbances(request, self.props, self.scenes, throws, displacement)

    @torch.inference_mode()
    def frames(self) -> Iterator[pb.SynthesizeReply]:
        """The initial frame, a frame per control step, and the summary.

        Raises UnstableError if the state becomes non-finite.
        """
        body = self.scenes.body()
        target = self.props.target(self.scenes)
        seen = state(body, target)
        held, success_s, precision, success, fell = 0, -1.0, -1.0, False, False
        made = 0
        for step in range(self.steps + 1):
            style = None
            if step:
                self.disturbances.step(step - 1, body)
                target = self.props.target(self.scenes)
                action = self._action(body, target, step)
                self.scenes.act(action)
                if not bool(self.scenes.finite()[0]):
                    raise UnstableError(
                        f"the simulation blew up after {step / character.CONTROL_HZ:.2f} s: start "
                        "from another pose, or push less"
                    )
                body, target = self.scenes.body(), self.props.target(self.scenes)
                now = state(body, target)
                if self._served.style is not None:
                    style = float(self._served.style(seen, now)[0])
                seen = now
            error = float(self._task.error_m(body, target)[0])
            success = error <= self._task.success_m
            falls = bool(self._task.fell(body, target)[0])
            fell = fell or falls
            held = held + 1 if success else 0
            if success and not fell:
                if success_s < 0:
                    success_s = step / character.CONTROL_HZ
                precision = error if precision < 0 else min(precision, error)
            frame = self._frame(step, body, style)
            terms = self._task.reward_terms(body, target)
            frame.reward_terms.extend(terms[0].tolist())
            frame.reward = float((terms * self._weights).sum())
            frame.error_m, frame.success, frame.fell = error, success, falls
            made += 1
            yield pb.SynthesizeReply(frame=frame)
            if (fell or held >= self._hold) and not self._to_the_end:
                break
        yield pb.SynthesizeReply(
            summary=pb.SynthesisSummary(
                frames=made,
                success=success_s >= 0,
                fell=fell,
                success_s=success_s,
                precision_m=precision,
                balls_thrown=self.disturbances.balls_thrown,
                displaced=self.disturbances.moved,
            )
        )

    def _action(self, body: Body, target: Target, step: int) -> Tensor:
        observation = torch.cat(
            (state(body, target), self._task.goal_features(body, target)), dim=1
        )  # fmt: skip
        action = self._served.act(observation)
        if self._seed is not None:
            action = action + self._served.sigma * torch.from_numpy(noise(self._seed, step, 1))
        return action

    def _frame(self, step: int, body: Body, style: float | None) -> pb.Frame:
        qpos, qvel = self.scenes.qpos[0], self.scenes.qvel[0]
        position, rotation = self.props.pose(self.scenes)
        frame = pb.Frame(
            time_s=step / character.CONTROL_HZ,
            root_position=qpos[:3].tolist(),
            root_rotation=qpos[3:7].tolist(),
            joint_position=qpos[7:].tolist(),
            joint_velocity=qvel[6:].tolist(),
            object_position=position,
            object_rotation=rotation,
        )
        if style is not None:
            frame.style_score = style
        for index, at in enumerate(self.disturbances.balls().tolist()):
            if at[0] == at[0]:  # balls out of the scene are NaN
                frame.balls.add(number=index, position=at)
        if self._with_bodies:
            frame.body_position.extend(body.position[0].flatten().tolist())
            frame.body_rotation.extend(body_rotations(qpos[None])[0].flatten().tolist())
        return frame


def body_rotations(qpos: Tensor) -> Tensor:
    """Rotations [n, 15, 4] (w, x, y, z) of the bodies in the world frame at qpos [n, 43]."""
    local = kinematics.local_rotations(qpos)
    found = [local[:, 0]]
    for body in range(1, len(character.BODIES)):
        found.append(rotations.multiply(found[character.PARENTS[body]], local[:, body]))
    return torch.stack(found, dim=1)


def _start(start: pb.Start) -> tuple[Numbers, Numbers]:
    """qpos [43] and qvel [34] of the initial state; default: standing at the origin, facing +x."""
    if start.WhichOneof("how") == "pose":
        return coordinates(start.pose, "start.pose")
    stance = start.standing
    x = number(stance.x, "start.standing.x", -1e3, 1e3)
    y = number(stance.y, "start.standing.y", -1e3, 1e3)
    half = 0.5 * number(stance.yaw_rad, "start.standing.yaw_rad", -100.0, 100.0)
    qpos = character.standing_qpos()
    qpos[:3] += x, y, _LIFT_M
    qpos[3:7] = np.cos(half), 0.0, 0.0, np.sin(half)
    return qpos, np.zeros(character.NV)
