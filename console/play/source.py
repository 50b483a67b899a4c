"""What a player can play: frames that were simulated or recorded, and what was measured in them."""

from dataclasses import dataclass, field
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from console.recording.format import Take
from world.character import model as character
from world.scene.model import PROJECTILE_BODY


@dataclass(frozen=True)
class Curves:
    """What was measured, frame by frame; not a number where it was not."""

    terms: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    """Reward terms [T] by name, unweighted."""
    style: NDArray[np.float64] | None = None
    """[T] style reward; None without a discriminator."""
    error_m: NDArray[np.float64] | None = None
    """[T]; None where the goal is not known."""
    success_m: float = 0.0
    """Errors up to this are success."""
    fell: NDArray[np.bool_] | None = None
    """[T]."""
    missing: str = ""
    """What is not measured, and why; empty where everything is."""


class Source(Protocol):
    """T frames at the control rate, 1/30 s."""

    model: mujoco.MjModel
    """Of the scene."""

    def __len__(self) -> int:
        """T."""
        ...

    def extend(self) -> bool:
        """Simulate one more frame; False where there is none to come."""
        ...

    def cut(self, frame: int) -> None:
        """Forget what comes after `frame`, so that what comes next goes on from there."""
        ...

    def poses(self, frame: int) -> NDArray[np.float64]:
        """Positions (m) and rotations (w, x, y, z) of the model's bodies [nbody, 7], world;
        positions that are not numbers: out of the scene."""
        ...

    def state(self, frame: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The character's coordinates [43] and velocities [34]."""
        ...

    def curves(self) -> Curves:
        """What was measured."""
        ...

    def take(self) -> Take:
        """Everything as a recording's take."""
        ...

    def status(self, frame: int) -> str:
        """One line on a frame."""
        ...


class Poser:
    """Poses of a model's bodies from the coordinates that a recording keeps."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._balls = [
            i for i in range(model.nbody) if model.body(i).name.startswith(PROJECTILE_BODY)
        ]

    def poses(
        self,
        qpos: NDArray[np.float64],
        mocap_pos: NDArray[np.float64],
        mocap_quat: NDArray[np.float64],
        balls: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """[nbody, 7] of qpos [43 or more], mocap bodies [m, 3] and [m, 4], balls [k, 3]."""
        data = self._data
        data.qpos[: len(qpos)] = np.nan_to_num(qpos)
        data.mocap_pos[: len(mocap_pos)] = mocap_pos
        data.mocap_quat[: len(mocap_quat)] = mocap_quat
        mujoco.mj_kinematics(self._model, data)
        found = np.concatenate((data.xpos, data.xquat), axis=1)
        for body, position in zip(self._balls, balls, strict=False):
            found[body, :3] = position
        return found


def heading(qpos: NDArray[np.float64]) -> float:
    """Yaw of the root's x axis, rad, of coordinates [43]."""
    w, x, y, z = qpos[3:7]
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


#: Frames a second.
HZ = character.CONTROL_HZ
