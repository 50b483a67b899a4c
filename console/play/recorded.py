"""Sources from a file: the takes of a recording, with their measures, or clips."""

from pathlib import Path

import mujoco
import numpy as np
import torch
from numpy.typing import NDArray

from console.kinds import kind
from console.motions import play
from console.motions.page import furniture
from console.play.source import HZ, Curves
from console.recording import format as recording
from console.recording.format import Recording, Take
from world import tasks
from world.character import features
from world.character import model as character
from world.errors import ConfigError, InhabitError
from world.motions import clip_file
from world.motions.clip import Clip
from world.motions.fit.floor import resampled

_UNKNOWN = "no reward terms: "


class Recorded:
    """A recorded take; a Source that cannot continue."""

    def __init__(
        self, take: Take, name: str, curves: Curves, origins: dict[str, str] | None = None
    ) -> None:
        self.model, self.name = recording.model_of(take), name
        self.piece = take.piece
        self._take, self._curves, self._origins = take, curves, origins or {}
        self._data = mujoco.MjData(self.model)

    def __len__(self) -> int:
        return len(self._take)

    def extend(self) -> bool:
        """See Source."""
        return False

    def cut(self, frame: int) -> None:
        """See Source."""
        raise ConfigError("a recording cannot be continued: play a run instead")

    def poses(self, frame: int) -> NDArray[np.float64]:
        """See Source."""
        recording.pose(self.model, self._data, self._take, frame)
        found = np.concatenate((self._data.xpos, self._data.xquat), axis=1)
        found[found[:, 0] <= recording.AWAY_M, :3] = np.nan
        return found

    def state(self, frame: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """See Source."""
        take = self._take
        return take.qpos[frame, : character.NQ], take.qvel[frame, : character.NV]

    @property
    def follows(self) -> bool:
        """Whether the character follows another one, which is recorded with it."""
        return len(self._take.ghost) > 0

    def followed(self, frame: int) -> NDArray[np.float64]:
        """That one's coordinates [43]."""
        return self._take.ghost[frame]

    def curves(self) -> Curves:
        """See Source."""
        return self._curves

    def take(self) -> Take:
        """See Source."""
        return self._take

    def status(self, frame: int) -> str:
        """See Source."""
        error, fell = self._curves.error_m, self._curves.fell
        if error is None or fell is None:
            return ""
        word = "**fallen**" if fell[frame] else ""
        if not word and error[frame] <= self._curves.success_m:
            word = "**success**"
        return f"{100 * error[frame]:.0f} cm from the goal" + (f", {word}" if word else "")

    def origins(self) -> dict[str, str]:
        """See Source."""
        return self._origins


def read(path: Path) -> dict[str, Recorded]:
    """Return the takes of a recording, or the clips of a file, by name.

    Raises InhabitError, in one line, for any other file.
    """
    if path.suffix == ".msgpack":
        takes = takes_of(recording.read(path), path.stem)
        if not takes:
            raise ConfigError(f"{path} holds no takes")
        return takes
    if path.suffix.lower() != clip_file.SUFFIX:
        raise ConfigError(
            f"{path}: cannot be played; choose a run, a checkpoint folder, a recording (.msgpack)"
            f" or a clip ({clip_file.SUFFIX})"
        )
    clips = play.clips([str(path)], None)
    nothing = Curves(missing="a clip has no goal: no reward terms, style score or success")
    return {
        f"{i + 1}: {clip.name}": Recorded(
            take_of(clip),
            clip.name,
            nothing,
            {"trained_on": clip.source, "licence": clip.licence},
        )
        for i, clip in enumerate(clips)
    }


def takes_of(found: Recording, name: str) -> dict[str, Recorded]:
    """The takes of a recording by number and by what each is of."""
    task = str(found.meta.get("task", ""))
    stated = ((key, found.meta.get(key)) for key in ("trained_on", "licence"))
    origins = {key: str(value) for key, value in stated if value}
    return {
        f"{i + 1}: {take.meta.get('clip') or take.piece or 'nothing'}": Recorded(
            take, name, measured(take, task), origins
        )
        for i, take in enumerate(found.takes)
        if len(take)
    }


def measured(take: Take, task: str) -> Curves:
    """Return reward terms, errors and falls of a take, if its target is recorded."""
    if task not in tasks.REGISTRY:
        return Curves(missing=_UNKNOWN + "the recording names no task")
    what = tasks.make(task)
    try:
        target = kind(what).recorded(take, what)
    except InhabitError as error:
        return Curves(missing=f"{_UNKNOWN}{error}")
    qpos = torch.from_numpy(take.qpos[:, : character.NQ]).float().nan_to_num()
    qvel = torch.from_numpy(take.qvel[:, : character.NV]).float().nan_to_num()
    body = features.body(qpos, qvel)
    terms = what.reward_terms(body, target).double().numpy()
    return Curves(
        terms={name: terms[:, i] for i, name in enumerate(what.terms)},
        error_m=what.error_m(body, target).double().numpy(),
        success_m=what.success_m,
        fell=what.fell(body, target).numpy(),
        missing="no style score: a recording has no discriminator",
    )


def take_of(clip: Clip) -> Take:
    """Return a clip as a take, with blocks for its seat or bed."""
    clip = resampled(clip)
    frames = clip.frames
    qpos, qvel = clip.qpos().astype(np.float64), clip.qvel().astype(np.float64)
    blocks = [
        [
            *block["centre_m"],
            *block["half_m"],
            np.cos(block["yaw_rad"] / 2),
            0.0,
            0.0,
            np.sin(block["yaw_rad"] / 2),
        ]
        for block in furniture(clip)
    ]
    cargo, stand = np.zeros(0), np.zeros(0)
    if clip.box is not None:
        qpos = np.concatenate((qpos, clip.box.pose.astype(np.float64)), axis=1)
        qvel = np.concatenate((qvel, np.zeros((frames, 6))), axis=1)
        cargo = np.array(clip.box.size_m) / 2
        stand = _below(clip.box.pose[-1, :3], cargo)
    return Take(
        qpos=qpos,
        qvel=qvel,
        ctrl=np.zeros((frames, character.NU)),
        mocap_pos=np.zeros((frames, 3)),
        mocap_quat=np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1)),
        boxes=np.array(blocks).reshape(-1, 10),
        piece=clip.name,
        scale=1.0,
        meta={"fps": HZ},
        cargo=cargo,
        stand=stand,
    )


def _below(position: NDArray[np.float32], half: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the centre of the top of a stand under a box at position [3]."""
    return position.astype(np.float64) - np.array([0.0, 0.0, half[2]])
