"""Penalties of how a character moves, in addition to a task's reward: foot skating, jerk, and hands
held up at rest.

The first two are the measures of world.realism, of one control step. The paper has none: its style
reward alone judges the motion.
"""

import torch
from torch import Tensor

from world.character import model as character
from world.character import soles
from world.character.features import Body
from world.config import PenaltyConfig
from world.device import CPU
from world.realism import measures, rest
from world.tasks.reward import penalties

HZ = float(character.CONTROL_HZ)
#: Jerk that costs the whole weight, m/s^3; mocap of walking has 140.
JERK_M_S3 = 500.0
#: Skating that costs the whole weight, m/s.
SKATING_M_S = 1.0
#: So high above the pelvis are the hands of people who rest at most (the package's clips: 0.16 m,
#: folded on the belly), m; so much higher they cost the whole weight, m.
RESTING_M, HELD_M = 0.2, 0.3
#: Frames before the present one that a jerk needs.
_PAST = 3
_HANDS = [character.BODIES.index(f"{side}_hand") for side in ("right", "left")]


class Penalties:
    """The last frames of n scenes, and what their motion costs; with at least one weight."""

    def __init__(self, n: int, config: PenaltyConfig, device: torch.device = CPU) -> None:
        self._names = tuple(penalties(config))
        bodies = len(character.BODIES)
        self._positions = torch.zeros(_PAST, n, bodies, 3, device=device)
        self._soles = torch.zeros(n, 2, 4, 3, device=device)
        self._frames = torch.zeros(n, dtype=torch.int64, device=device)

    def after(self, body: Body) -> Tensor:
        """The terms [n, P] in [-1, 0] of the control step that ended in `body`, in the order of
        world.tasks.reward.penalties; once in each step."""
        corners, positions = body.soles, torch.cat((self._positions, body.position[None]))
        costs = {
            "skating": (_skating_m_s(self._soles, corners) / SKATING_M_S, 1),
            "jerk": (measures.jerk(positions, HZ)[0].mean(dim=-1) / JERK_M_S3, _PAST),
            "hands": (_held_m(body) / HELD_M, 0),
        }
        found = [
            torch.where(self._frames >= needed, -cost.clamp(max=1.0), 0.0)
            for cost, needed in (costs[name] for name in self._names)
        ]
        self._positions = positions[1:]
        self._soles = corners
        self._frames = self._frames + 1
        return torch.stack(found, dim=1)

    def reset(self, ids: Tensor, body: Body) -> None:
        """Forget the frames of the scenes `ids` [m], whose characters begin as in body [m]."""
        self._positions[-1, ids] = body.position
        self._soles[ids] = body.soles
        self._frames[ids] = 1

    def state_dict(self) -> dict[str, Tensor]:
        """The state between control steps, by name."""
        # a row for each scene: mixtures divide the state over actors by rows
        by_scene = self._positions.transpose(0, 1)
        return {"positions": by_scene, "soles": self._soles, "frames": self._frames}

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        for name, value in self.state_dict().items():
            value.copy_(state[name])


def _skating_m_s(before: Tensor, after: Tensor) -> Tensor:
    """[n]: mean horizontal speed of the corners that stand on the floor; 0 without any."""
    speed, planted = soles.slips(before, after, HZ)
    counted = torch.where(planted, speed, 0.0).flatten(1).sum(dim=1)
    return counted / planted.flatten(1).sum(dim=1).clamp(min=1)


def _held_m(body: Body) -> Tensor:
    """[n]: mean height of the hands beyond RESTING_M over the pelvis; 0 for one that moves."""
    above = body.position[:, _HANDS, 2] - body.position[:, :1, 2] - RESTING_M
    rests = body.root_velocity.norm(dim=1) < rest.RESTS_M_S
    return torch.where(rests, above.clamp(min=0.0).mean(dim=1), 0.0)
