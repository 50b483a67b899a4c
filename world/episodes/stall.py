"""Patience: an episode in which nothing comes about any more need not go on.

To stand still is safe, and near the goal it pays at every step, so that training may settle for it:
standing before a box, or with the box in hand, is a local optimum that a discount only softens.
Ended like a fall after some seconds, it is worth little more than trying.
"""

import torch
from torch import Tensor

from world.character import model as character
from world.character.features import Body
from world.device import CPU
from world.errors import ConfigError
from world.tasks import Place

#: The character gets on when its root moves by the first of these horizontally, m, or the box that
#: it is to carry by the second, from where they were when it last did.
_ROOT_M, _BOX_M = 0.25, 0.10


class Patience:
    """With n scenes."""

    def __init__(self, n: int, patience_s: float | None, device: torch.device = CPU) -> None:
        if patience_s is not None and not patience_s * character.CONTROL_HZ >= 1.0:
            raise ConfigError(f"patience_s {patience_s}: at least a control step, 1/30 s, or none")
        self._limit = None if patience_s is None else round(patience_s * character.CONTROL_HZ)
        self._root = torch.zeros(n, 2, device=device)
        self._box = torch.zeros(n, 3, device=device)
        self._still = torch.zeros(n, dtype=torch.int64, device=device)

    def ends(self, body: Body, place: Place, done: Tensor) -> Tensor:
        """[n] bool: who has not got on for too long, and is not done [n] bool. One control step."""
        root = body.root[:, :2]
        moves = (root - self._root).norm(dim=1) > _ROOT_M
        if place.box is not None:
            box = place.box.position
            moves |= (box - self._box).norm(dim=1) > _BOX_M
            self._box = torch.where(moves[:, None], box, self._box)
        self._root = torch.where(moves[:, None], root, self._root)
        self._still = torch.where(moves | done, 0, self._still + 1)
        if self._limit is None:
            return torch.zeros_like(moves)
        return self._still >= self._limit

    def reset(self, ids: Tensor, body: Body, place: Place) -> None:
        """Begin anew in the scenes `ids` [m], as body and place [m] are now."""
        self._root[ids], self._still[ids] = body.root[:, :2], 0
        if place.box is not None:
            self._box[ids] = place.box.position

    def memory(self) -> dict[str, Tensor]:
        """All that is kept from step to step, by name."""
        return {"root": self._root, "box": self._box, "still": self._still}

    def remember(self, memory: dict[str, Tensor]) -> None:
        """Go on from what `memory` gave."""
        for name, value in self.memory().items():
            value.copy_(memory[name])
