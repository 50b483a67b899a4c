"""Stepped scenes with all of their past moments."""

from typing import Generic, Protocol, TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from console.play.source import HZ, Poser
from world.character import model as character
from world.errors import InhabitError

#: Greatest number of frames: five minutes.
LIMIT = 300 * HZ


class UnstableError(InhabitError):
    """A simulation whose state became non-finite."""


class Stepped(Protocol):
    """A scene at one control step."""

    @property
    def physics(self) -> dict[str, Tensor]:
        """Physics of Scenes.physics, [1, ...]."""
        ...

    @property
    def balls(self) -> NDArray[np.float64]:
        """[k, 3] m; NaN for balls out of the scene."""
        ...


M = TypeVar("M", bound=Stepped)


class Playable(Protocol[M]):
    """What a page steps and disturbs."""

    model: mujoco.MjModel

    def now(self) -> M:
        """Return the present moment."""
        ...

    def step(self) -> M:
        """Step by 1/30 s; UnstableError for a non-finite state."""
        ...

    def restore(self, moment: M, step: int) -> None:
        """Restore a moment, before the control step `step`."""
        ...

    def push(self, impulse_n_s: NDArray[np.float64], body: str) -> None:
        """Push a body by an impulse [3] N s, world frame; ChoiceError for an unknown body."""
        ...

    def throw(self) -> None:
        """Throw a ball at the character, at the next step."""
        ...


class Frames(Generic[M]):
    """A scene and its moments; most of a Source."""

    def __init__(self, scene: Playable[M], rolling: bool = False) -> None:
        """rolling: the oldest moments are forgotten beyond LIMIT, instead of stopping there."""
        self.stepped = scene
        self.model: mujoco.MjModel = scene.model
        self.piece = ""
        self.moments: list[M] = [scene.now()]
        self.ended = ""
        """Reason why the scene does not continue, or ""."""
        self._rolling = rolling
        self._poser = Poser(self.model)

    def __len__(self) -> int:
        return len(self.moments)

    def extend(self) -> bool:
        """See Source."""
        if len(self.moments) >= LIMIT:
            if not self._rolling:
                self.ended = f"{LIMIT // HZ} s are recorded: start again, or continue from earlier"
                return False
            del self.moments[: LIMIT // 10]
        if self.ended:
            return False
        try:
            self.moments.append(self.stepped.step())
        except UnstableError as error:
            self.ended = str(error)
            return False
        return True

    def cut(self, frame: int) -> None:
        """See Source."""
        del self.moments[frame + 1 :]
        self.stepped.restore(self.moments[-1], frame)
        self.ended = ""

    def poses(self, frame: int) -> NDArray[np.float64]:
        """See Source."""
        moment = self.moments[frame]
        physics = {name: value[0].numpy() for name, value in moment.physics.items()}
        return self._poser.poses(
            physics["qpos"],
            physics["mocap_pos"].reshape(-1, 3),
            physics["mocap_quat"].reshape(-1, 4),
            moment.balls,
        )

    def state(self, frame: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """See Source."""
        physics = self.moments[frame].physics
        qpos, qvel = physics["qpos"][0].numpy(), physics["qvel"][0].numpy()
        return qpos[: character.NQ], qvel[: character.NV]
