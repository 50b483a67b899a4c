"""The mocap frame nearest to the character's motion, shown as a ghost."""

from dataclasses import dataclass

import mujoco
import numpy as np
import torch
from numpy.typing import NDArray

from console.evaluation.realism import clips_of
from console.play.source import heading
from discriminator import normaliser
from world.character import model as character
from world.motions.library import MotionLibrary
from world.realism import measures
from world.realism.measures import Motion

#: Mocap transitions to search, evenly over all, as for motion quality.
_REFERENCES = 60_000


@dataclass(frozen=True)
class Match:
    """The nearest frame of the mocap."""

    qpos: NDArray[np.float64]
    """[43] coordinates, at the character's position and heading."""
    distance: float
    """Distance of the transition, in standard deviations of the mocap's features (root mean
    square)."""
    clip: str
    """Name of the clip."""


class Ghost:
    """Finds the mocap transition nearest to one of the character's."""

    def __init__(self, library: MotionLibrary) -> None:
        clips, labels = clips_of(library)
        transitions = [measures.transitions(clip) for clip in clips]
        names = list(dict.fromkeys(c.name for c in library.clips if not _mirrored(c.name)))
        every = torch.cat(transitions)
        chosen = torch.linspace(0, len(every) - 1, min(len(every), _REFERENCES)).long()
        self._mean, self._deviation = normaliser.fit(every)
        self._reference = normaliser.normalise(every[chosen], self._mean, self._deviation)
        # the second frame of each transition
        self._qpos = torch.cat([clip.qpos[1:] for clip in clips])[chosen]
        label = [
            own for own, part in zip(labels, transitions, strict=True) for _ in range(len(part))
        ]
        self._clip = [names[label[i]] for i in chosen.tolist()]

    @torch.inference_mode()
    def nearest(self, motion: Motion) -> Match:
        """Return the mocap frame nearest to two consecutive ones, qpos [2, 43], qvel [2, 34]."""
        query = normaliser.normalise(measures.transitions(motion), self._mean, self._deviation)
        distance = torch.cdist(query, self._reference)[0]
        at = int(distance.argmin())
        qpos = placed(self._qpos[at].double().numpy(), motion.qpos[1].double().numpy())
        return Match(qpos, float(distance[at]) / query.shape[1] ** 0.5, self._clip[at])


def placed(qpos: NDArray[np.float64], where: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return coordinates [43] moved and turned to the position and heading of others [43]."""
    found = qpos.copy()
    found[:2] = where[:2]
    half = 0.5 * (heading(where) - heading(qpos))
    turn = np.array([np.cos(half), 0.0, 0.0, np.sin(half)])
    mujoco.mju_mulQuat(found[3:7], turn, qpos[3:7])
    return found


def _mirrored(name: str) -> bool:
    return name.endswith("~mirrored")


class GhostBody:
    """Kinematics of the ghost's fifteen bodies."""

    def __init__(self) -> None:
        self.model = character.spec().compile()
        self._data = mujoco.MjData(self.model)

    def poses(self, qpos: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return poses [nbody, 7] of coordinates [43]: positions (m) and rotations (w, x, y, z)."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self._data)
        return np.concatenate((self._data.xpos, self._data.xquat), axis=1)
