"""Pushes of the character in the player: impulses that are spread over one control step."""

import numpy as np
from numpy.typing import NDArray

from world.character import model as character
from world.errors import ChoiceError

#: Greatest impulse of a push, N s: 45 kg at 4.4 m/s.
MAX_IMPULSE_N_S = 200.0


class Pushes:
    """The pushes of one character that wait for its next step."""

    def __init__(self, step_s: float) -> None:
        """step_s: time over which an impulse is spread, s."""
        self._step_s = step_s
        self._waiting: list[tuple[int, NDArray[np.float64]]] = []

    def add(self, impulse_n_s: NDArray[np.float64], body: str) -> None:
        """Add a push of a body by an impulse [3] N s, world frame; a larger one is shortened.

        Raises ChoiceError for an unknown body.
        """
        if body not in character.BODIES:
            raise ChoiceError("body", body, list(character.BODIES))
        size = float(np.linalg.norm(impulse_n_s))
        shrunk = impulse_n_s * min(1.0, MAX_IMPULSE_N_S / max(size, 1e-9))
        # body 0 of the model is the world
        self._waiting.append((1 + character.BODIES.index(body), shrunk / self._step_s))

    def apply(self, force: NDArray[np.float64]) -> None:
        """Set the forces and torques [bodies, 6] of the step that begins to those of the waiting
        pushes."""
        force[:] = 0.0
        for index, pushed in self._waiting:
            force[index, :3] += pushed
        self._waiting.clear()

    def clear(self) -> None:
        """Forget the waiting pushes."""
        self._waiting.clear()
