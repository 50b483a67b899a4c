"""What a porter remembers of the step that it makes, told by its neck, so that it can be seen.

Which foot steps, since when, how far and with what turn is nearly all that a policy without memory
misses of what a porter says (docs/recipe.md, "Memory that can be seen"). So the head sways from
side to side with the steps, nods by their length and turns with them; the porter itself reads
length, turn and the first foot off it, and a policy that was taught by it sees its own neck.
"""

import torch
from torch import Tensor

from world.character import model as character
from world.character import servos
from world.teachers.gait import SHIFT, SWING_STEPS, Gait

_NAMES = [joint.name for joint in character.JOINTS for _ in joint.range_deg]
#: The neck's servos: to the right, forward and to the left, as it turns about x, y and z.
NECK = slice(_NAMES.index("neck"), _NAMES.index("neck") + 3)
#: Bent forward by so much a metre that a step goes ahead, rad/m; turned as the step turns.
_NOD_RAD_M = 0.7
#: To this on either side while the feet step, rad: from the side of the foot that steps to the
#: other one's by when it lands.
_SWAY_RAD = 0.15
#: From so many control steps after a foot lifted on the neck tells what was wished for; no step
#: goes further ahead, m, and turns by more, rad.
_TOLD_BY, _AHEAD_M, _MOST_RAD = 6.0, (-0.3, 0.5), 0.7
#: From so many after the weight began to shift on, a sway within these, rad, tells for which foot.
_SHIFT_TOLD_BY, _LEANS_RAD = 4.0, (0.05, 0.3)


def angles(qpos: Tensor) -> Tensor:
    """[n, 3]: where the neck is at qpos [n, 43], rad, as its servos measure it."""
    return servos.coordinates(qpos)[:, NECK]


def pose(gait: Gait, wish: Tensor) -> Tensor:
    """[n, 3]: where the neck of those who do not stand should be, rad; wish [n, 3]: of the step
    ahead and to the left, m, and its turn, rad."""
    steps = ((gait.time + 1.0) / (SWING_STEPS + 1.0)).clamp(0.0, 1.0)
    steps = torch.where(gait.walks, steps, 0.0)
    side = torch.where(gait.swing == 1, _SWAY_RAD, -_SWAY_RAD).double()
    told = (side * (2.0 * steps - 1.0), _NOD_RAD_M * wish[:, 0], wish[:, 2])
    return torch.stack(told, dim=1)


def read(gait: Gait, neck: Tensor, wish: Tensor) -> Tensor:
    """The wish [n, 3], its length ahead and its turn as the neck [n, 3] rad tells them, where it
    has had the time to."""
    ahead = (neck[:, 1] / _NOD_RAD_M).clamp(*_AHEAD_M)
    turn = neck[:, 2].clamp(-_MOST_RAD, _MOST_RAD)
    seen = torch.stack((ahead, wish[:, 1], turn), dim=1)
    tells = gait.walks & (gait.landed | (gait.time >= _TOLD_BY))
    return torch.where(tells[:, None], seen, wish)


def first_foot(gait: Gait, neck: Tensor) -> Tensor:
    """[n]: the foot that is in the air or next; of who shifts his weight, the one that the neck
    [n, 3] rad tells: with two to choose from, who looks on would else go on calling for the other
    one."""
    sway = neck[:, 0]
    told = (sway.abs() > _LEANS_RAD[0]) & (sway.abs() < _LEANS_RAD[1])
    tells = (gait.mode == SHIFT) & (gait.time >= _SHIFT_TOLD_BY) & told
    return torch.where(tells, (sway < 0.0).long(), gait.swing)
