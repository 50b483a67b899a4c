"""The stall time-out: ends an episode in which neither character nor box gets on any more.

Standing in front of a box, or with the box in hand above its target, is safe and rewarded at every
step: a local optimum of the return. The time-out ends such an episode as a fall, so that it returns
little more than a failed attempt.
"""

import torch
from torch import Tensor

from world.character import model as character
from world.character.features import Body
from world.device import CPU
from world.errors import ConfigError
from world.scene.target import Target
from world.tasks import detour

#: The stall clock restarts when the root moves horizontally by the first of these, m, or the box by
#: the second, from their positions at the last restart.
_ROOT_M, _BOX_M = 0.25, 0.10
#: With a box that is farther than _BOX_M from its stand the clock restarts only when the box is
#: nearer to its target, by this, m, than at the last restart, on the way round its stand: steps to
#: and fro, or in circles, do not count.
_NEARER_M = 0.05
#: A distance from the target that every box is nearer than, m.
_FAR_M = 1e6


class StallTimeout:
    """The stall clocks of n scenes."""

    def __init__(self, n: int, stall_s: float | None, device: torch.device = CPU) -> None:
        if stall_s is not None and not stall_s * character.CONTROL_HZ >= 1.0:
            raise ConfigError(
                f"--world.stall-s {stall_s}: choose none or at least a control step, 1/30 s"
            )
        self._limit = None if stall_s is None else round(stall_s * character.CONTROL_HZ)
        self._root = torch.zeros(n, 2, device=device)
        self._box = torch.zeros(n, 3, device=device)
        self._nearest = torch.full((n,), _FAR_M, device=device)
        self._still = torch.zeros(n, dtype=torch.int64, device=device)

    def ends(self, body: Body, target: Target, done: Tensor) -> Tensor:
        """Return [n] bool: the scenes whose clock has expired; done [n] bool holds the clock at 0.

        Must be called once in each control step.
        """
        root = body.root[:, :2]
        moves = (root - self._root).norm(dim=1) > _ROOT_M
        if target.box is not None:
            box = target.box.position
            moves |= (box - self._box).norm(dim=1) > _BOX_M
            away = (box - target.box.start).norm(dim=1) > _BOX_M
            # with the detour round its stand: who goes round it brings the box away at first
            to_target = (target.box.target - box).norm(dim=1)
            stand, goal = target.box.start[:, :2], target.box.target[:, :2]
            to_target = to_target + detour.extra_m(root, stand, goal)
            moves = torch.where(away, to_target < self._nearest - _NEARER_M, moves)
            nearest = torch.where(moves, to_target, self._nearest)
            self._nearest = torch.where(away, nearest, _FAR_M)
            self._box = torch.where(moves[:, None], box, self._box)
        self._root = torch.where(moves[:, None], root, self._root)
        self._still = torch.where(moves | done, 0, self._still + 1)
        if self._limit is None:
            return torch.zeros_like(moves)
        return self._still >= self._limit

    def reset(self, ids: Tensor, body: Body, target: Target) -> None:
        """Restart the clocks of the scenes `ids` [m] at body and target [m]."""
        self._root[ids], self._still[ids] = body.root[:, :2], 0
        if target.box is not None:
            self._box[ids], self._nearest[ids] = target.box.position, _FAR_M

    def state_dict(self) -> dict[str, Tensor]:
        """Return the state between steps, by name."""
        return {
            "root": self._root,
            "box": self._box,
            "nearest": self._nearest,
            "still": self._still,
        }

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        for name, value in self.state_dict().items():
            if name in state or name != "nearest":  # older checkpoints lack it
                value.copy_(state[name])
