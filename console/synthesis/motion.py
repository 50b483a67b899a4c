"""One simulated motion: the whole result of a `Simulation`, for the writers of files."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from console.evaluation.stepping import Track
from console.recording.clip import clip_of
from console.recording.format import Take, rows_of
from policy.checkpoints import lineage
from policy.checkpoints.served import Served
from policy.synthesis.simulation import Simulation
from rpc.v1 import policy_pb2 as pb
from world.character import model as character
from world.furniture.piece import Piece
from world.motions.clip import Clip
from world.scene.box import STAND
from world.scene.target import Target
from world.scene.target import state as state_of

#: Longest motion, s.
MOST_S = 600.0
_GRASPED = "grasped"


@dataclass(frozen=True)
class Motion:
    """T frames of one character in one scene, from the initial state on."""

    served: Served
    piece: str
    """Name of the object."""
    track: Track
    frames: tuple[pb.Frame, ...]
    """[T] reward terms, style, success."""
    summary: pb.SynthesisSummary
    targets: tuple[Target, ...]
    """[T] targets."""
    held: NDArray[np.bool_]
    """[T] True while both hands hold the box; False without a box."""
    shape: Piece | None = None
    """The scaled furniture of a command; None where the request has it."""

    @property
    def seconds(self) -> float:
        return (len(self.frames) - 1) / character.CONTROL_HZ

    @property
    def fell_at(self) -> int | None:
        """Index of the first frame with a fall; None without a fall."""
        return next((i for i, frame in enumerate(self.frames) if frame.fell), None)

    @property
    def succeeded(self) -> bool:
        """True if the last frame is a success and no frame a fall."""
        return self.frames[-1].success and self.fell_at is None

    def outcome(self) -> str:
        """Return the outcome in a few words."""
        summary, last = self.summary, self.frames[-1]
        falls = ""
        if self.fell_at is not None:
            falls = f", falls after {self.frames[self.fell_at].time_s:.1f} s"
        if not summary.success:
            nearest = min(frame.error_m for frame in self.frames)
            return f"never nearer than {100 * nearest:.0f} cm{falls}"
        held = "" if falls or not last.success else ", and held"
        return f"target reached after {summary.success_s:.1f} s{held}{falls}"

    def licence(self) -> str:
        """Return the licence of the motion, whole: the policy's and, of furniture from elsewhere,
        that of the piece."""
        own, piece = lineage.licence(self.served.manifest.notes), self.shape
        if piece is None:
            return own
        return lineage.with_furniture(own, piece.name, piece.licence, piece.credit)

    def clip(self) -> Clip:
        """Return the motion as a clip, with its seat, bed or box."""
        served = self.served
        made = clip_of(
            self.track.take,
            f"{served.task.name}-{self.piece}",
            f"synthesised by policy {served.name}, version {served.version}",
            self.licence(),
            held=self.held,
        )
        run = self._stretch()
        if run is None:
            return made
        return served.task.affordance.clips.with_object(made, self.targets[run[0]], run)

    def _stretch(self) -> tuple[int, int] | None:
        """Return the longest run of successful frames, as first and one beyond the last; None
        without any."""
        there = [frame.success and not frame.fell for frame in self.frames]
        best, start = (0, 0), 0
        for at, good in enumerate([*there, False]):
            if good:
                continue
            best = max(best, (start, at), key=lambda run: run[1] - run[0])
            start = at + 1
        return best if best[1] > best[0] else None


def simulate(
    request: pb.SynthesizeRequest,
    served: Served,
    piece: Piece | None = None,
    progress: Callable[[int], None] = lambda frame: None,
) -> Motion:
    """Return the motion of a request, by the policy `served`.

    piece: the scaled furniture, instead of the request's shape. Raises RequestError for an invalid
    request, UnstableError for a non-finite state.
    """
    simulation = Simulation(request, served, MOST_S, piece)
    task, scenes = served.task, simulation.scenes
    carries = task.affordance.cargo
    rows: list[dict[str, Tensor]] = []
    frames: list[pb.Frame] = []
    targets: list[Target] = []
    held: list[bool] = []
    summary = pb.SynthesisSummary()
    for reply in simulation.frames():
        if reply.HasField("summary"):
            summary = reply.summary
            continue
        # the generator is suspended at this frame
        body, target = scenes.body(), simulation.props.target(scenes)
        row = {name: value[0] for name, value in scenes.physics().items()}
        row |= {"state": state_of(body, target)[0], "balls": simulation.disturbances.balls()}
        rows.append(row)
        frames.append(reply.frame)
        targets.append(target)
        stages = task.stage(body, target)[0]
        held.append(carries and bool(stages[list(task.stages).index(_GRASPED)]))
        progress(len(frames))

    def column(name: str) -> NDArray[np.float64]:
        return np.stack([row[name].double().numpy() for row in rows])

    boxes = simulation.props.boxes()
    name = request.furniture.piece or task.affordance.kind if piece is None else piece.name
    fell_at = next((i for i, frame in enumerate(frames) if frame.fell), None)
    take = Take(
        column("qpos")[:, : character.NQ + 7 * carries],
        column("qvel")[:, : character.NV + 6 * carries],
        column("ctrl"),
        column("mocap_pos")[:, 0],
        column("mocap_quat")[:, 0],
        rows_of(STAND.boxes if carries else boxes),
        name,
        request.furniture.scale if request.furniture.HasField("scale") else 1.0,
        {"fell_at_step": fell_at, "seconds": (len(frames) - 1) / character.CONTROL_HZ}
        | ({"ball_radius_m": simulation.balls[0].radius_m} if simulation.balls else {}),
        column("balls"),
        np.array(boxes[0].half_m) if carries else np.zeros(0),
        column("mocap_pos")[0, 1] if carries else np.zeros(0),
    )
    error = np.array([frame.error_m for frame in frames], np.float32)
    steps = len(frames) if fell_at is None else fell_at
    track = Track(take, column("state").astype(np.float32), error, simulation.props.model, steps)
    return Motion(
        served, name, track, tuple(frames), summary, tuple(targets), np.array(held, np.bool_), piece
    )
