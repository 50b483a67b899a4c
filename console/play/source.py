"""Sources of a player: simulated or recorded frames, with their measures."""

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
    """Measures of each frame; NaN where missing."""

    terms: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    """Reward terms [T] by name, unweighted."""
    style: NDArray[np.float64] | None = None
    """[T] style reward; None without a discriminator."""
    error_m: NDArray[np.float64] | None = None
    """[T] distance from the target, m; None without a target."""
    success_m: float = 0.0
    """Largest distance that counts as success, m."""
    fell: NDArray[np.bool_] | None = None
    """[T] whether the character has fallen; None without a target."""
    missing: str = ""
    """Text on missing measures; empty without any."""


class Source(Protocol):
    """T frames at the control rate, 1/30 s."""

    model: mujoco.MjModel
    """Model of the scene."""
    piece: str
    """Name of the furniture, whose class gives its colour; empty: the colours of the model."""

    def __len__(self) -> int:
        """Return T."""
        ...

    def extend(self) -> bool:
        """Simulate one more frame; False if the source cannot continue."""
        ...

    def cut(self, frame: int) -> None:
        """Discard the frames after `frame`, from which the source then continues."""
        ...

    def poses(self, frame: int) -> NDArray[np.float64]:
        """Return positions (m) and rotations (w, x, y, z) of the model's bodies [nbody, 7], world;
        positions NaN: out of the scene."""
        ...

    def state(self, frame: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the character's coordinates [43] and velocities [34]."""
        ...

    def curves(self) -> Curves:
        """Return the measures of all frames."""
        ...

    def take(self) -> Take:
        """Return all frames as a take."""
        ...

    def status(self, frame: int) -> str:
        """Return one line on a frame."""
        ...

    def origins(self) -> dict[str, str]:
        """Return the data that the motion stems from, as `trained_on`, and its terms, as `licence`,
        both whole; none where they are not known."""
        ...


class Poser:
    """Kinematics of a model's bodies from recorded coordinates."""

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
        """Return poses [nbody, 7] of qpos [43 or more], mocap bodies [m, 3] and [m, 4], balls
        [k, 3]."""
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
    """Return the yaw of the root's x axis, rad, of coordinates [43]."""
    w, x, y, z = qpos[3:7]
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


#: Frames per second.
HZ = character.CONTROL_HZ
