"""The mocap nearest to what the character does, as a ghost beside it."""

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

#: Transitions of the mocap that are looked among, evenly over all of them, as motion quality does.
_REFERENCES = 60_000


@dataclass(frozen=True)
class Match:
    """The nearest frame of the mocap."""

    qpos: NDArray[np.float64]
    """[43], moved to where the character is and turned to its heading."""
    distance: float
    """To the transition, in standard deviations of the mocap's features (root mean square)."""
    clip: str
    """Its clip's name."""


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
        # of a transition, the frame that it leads to
        self._qpos = torch.cat([clip.qpos[1:] for clip in clips])[chosen]
        label = [
            own for own, part in zip(labels, transitions, strict=True) for _ in range(len(part))
        ]
        self._clip = [names[label[i]] for i in chosen.tolist()]

    @torch.inference_mode()
    def nearest(self, motion: Motion) -> Match:
        """The frame nearest to the second of two consecutive ones, qpos [2, 43], qvel [2, 34]."""
        query = normaliser.normalise(measures.transitions(motion), self._mean, self._deviation)
        distance = torch.cdist(query, self._reference)[0]
        at = int(distance.argmin())
        qpos = placed(self._qpos[at].double().numpy(), motion.qpos[1].double().numpy())
        return Match(qpos, float(distance[at]) / query.shape[1] ** 0.5, self._clip[at])


def placed(qpos: NDArray[np.float64], where: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coordinates [43] moved to the floor point and turned to the heading of others [43]."""
    found = qpos.copy()
    found[:2] = where[:2]
    half = 0.5 * (heading(where) - heading(qpos))
    turn = np.array([np.cos(half), 0.0, 0.0, np.sin(half)])
    mujoco.mju_mulQuat(found[3:7], turn, qpos[3:7])
    return found


def _mirrored(name: str) -> bool:
    return name.endswith("~mirrored")


class GhostBody:
    """Poses of the ghost's fifteen bodies."""

    def __init__(self) -> None:
        self.model = character.spec().compile()
        self._data = mujoco.MjData(self.model)

    def poses(self, qpos: NDArray[np.float64]) -> NDArray[np.float64]:
        """[nbody, 7] of coordinates [43]: positions (m) and rotations (w, x, y, z)."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self._data)
        return np.concatenate((self._data.xpos, self._data.xquat), axis=1)
