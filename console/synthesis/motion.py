"""One simulated motion: what `Simulation` made of a request, whole, as the writers of files take
it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from console.evaluation.stepping import Track
from console.recording.format import Take, rows_of
from policy.checkpoints.served import Served
from policy.synthesis.simulation import Simulation
from rpc.v1 import policy_pb2 as pb
from world.character import kinematics
from world.character import model as character
from world.furniture.piece import Piece
from world.motions.clip import Clip
from world.motions.objects import BoxTrack
from world.scene.box import STAND
from world.scene.target import Target
from world.scene.target import state as state_of

#: Longest motion, s.
MOST_S = 600.0
_GRASPED = "grasped"


@dataclass(frozen=True)
class Motion:
    """T frames of one character in one scene, from its start on."""

    served: Served
    piece: str
    """What it uses, by name."""
    track: Track
    frames: tuple[pb.Frame, ...]
    """[T]: reward terms, style, success."""
    summary: pb.SynthesisSummary
    targets: tuple[Target, ...]
    """[T]: where what it uses is."""
    held: NDArray[np.bool_]
    """[T]: whether both hands hold the box; nowhere true without one."""

    @property
    def seconds(self) -> float:
        return (len(self.frames) - 1) / character.CONTROL_HZ

    @property
    def fell_at(self) -> int | None:
        """The first frame in which the character lies where it should not; None: it never does."""
        return next((i for i, frame in enumerate(self.frames) if frame.fell), None)

    @property
    def succeeded(self) -> bool:
        """Whether it is where it should be at the end, and never falls."""
        return self.frames[-1].success and self.fell_at is None

    def told(self) -> str:
        """What happened, in a few words."""
        summary, last = self.summary, self.frames[-1]
        falls = ""
        if self.fell_at is not None:
            falls = f", falls after {self.frames[self.fell_at].time_s:.1f} s"
        if not summary.success:
            nearest = min(frame.error_m for frame in self.frames)
            return f"never nearer than {100 * nearest:.0f} cm{falls}"
        stays = "" if falls or not last.success else ", and stays"
        return f"there after {summary.success_s:.1f} s{stays}{falls}"

    def clip(self) -> Clip:
        """As a motion clip, with the seat, bed or box that it used."""
        qpos = self.track.take.qpos[:, : character.NQ]
        served, notes = self.served, self.served.manifest.notes
        made = Clip(
            name=f"{served.task.name}-{self.piece}",
            fps=character.CONTROL_HZ,
            root_position_m=qpos[:, :3].astype(np.float32),
            local_rotation=_local(qpos),
            source=f"synthesised by policy {served.name}, version {served.version}",
            licence=notes.get("licence", "") or notes.get("data_licences", "") or "unknown",
            box=self._box(),
        )
        run = self._stretch()
        if run is None:
            return made
        return served.task.affordance.clips.with_object(made, self.targets[run[0]], run)

    def _stretch(self) -> tuple[int, int] | None:
        """The longest run of frames that are a success and no fall: first, one beyond the last."""
        there = [frame.success and not frame.fell for frame in self.frames]
        best, start = (0, 0), 0
        for at, good in enumerate([*there, False]):
            if good:
                continue
            best = max(best, (start, at), key=lambda run: run[1] - run[0])
            start = at + 1
        return best if best[1] > best[0] else None

    def _box(self) -> BoxTrack | None:
        take = self.track.take
        if not len(take.cargo):
            return None
        x, y, z = (2.0 * take.cargo).tolist()
        return BoxTrack(take.qpos[:, character.NQ :].astype(np.float32), (x, y, z), self.held)


def simulate(
    request: pb.SynthesizeRequest,
    served: Served,
    piece: Piece | None = None,
    progress: Callable[[int], None] = lambda frame: None,
) -> Motion:
    """The motion that a request asks for, of the policy `served`.

    piece: the furniture, at its scale, in the place of the request's shape. Raises RequestError for
    what cannot be simulated, UnstableError where the simulation blows up.
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
        # the simulation waits at this frame until it is asked for the next
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
        served, name, track, tuple(frames), summary, tuple(targets), np.array(held, np.bool_)
    )


def _local(qpos: NDArray[np.float64]) -> NDArray[np.float32]:
    import torch

    return kinematics.local_rotations(torch.from_numpy(qpos)).float().numpy()
