"""The phase cue: the neck shows the step under way, so that a student without memory observes it.

Swing foot, time, length and turn of the step are most of what a policy without memory lacks to
predict the teacher's action (docs/recipe.md, "Memory that can be seen"). The head sways from side
to side with the steps, pitches with their length and turns with them. The teacher reads length,
turn and first foot back from the neck, and a trained policy observes its own neck.
"""

import torch
from torch import Tensor

from world.character import model as character
from world.character import servos
from world.teachers.scripted.gait import SHIFT, SWING_STEPS, Gait

_NAMES = [joint.name for joint in character.JOINTS for _ in joint.range_deg]
#: The neck's servos: rotations about x (right), y (forward) and z (left).
NECK = slice(_NAMES.index("neck"), _NAMES.index("neck") + 3)
#: Pitch per metre of step length, rad/m; the neck's turn is the turn of the step.
_PITCH_RAD_M = 0.7
#: Amplitude of the sway, rad. It runs from the side of the swing foot at lift-off to the other side
#: at touch-down.
_SWAY_RAD = 0.15
#: The neck is read from this many control steps after lift-off on; readings are clamped to these
#: bounds of the step's length, m, and turn, rad.
_READ_FROM, _LENGTH_M, _TURN_RAD = 6.0, (-0.3, 0.5), 0.7
#: During a weight shift the sway is read from this many control steps on, where its size is within
#: these bounds, rad.
_SHIFT_READ_FROM, _SWAY_READ_RAD = 4.0, (0.05, 0.3)


def angles(qpos: Tensor) -> Tensor:
    """[n, 3]: angles of the neck at qpos [n, 43], rad, in the coordinates of its servos."""
    return servos.coordinates(qpos)[:, NECK]


def pose(gait: Gait, command: Tensor) -> Tensor:
    """[n, 3]: set-point of the neck of walking characters, rad; command [n, 3]: step ahead and to
    the left, m, and turn, rad."""
    progress = ((gait.time + 1.0) / (SWING_STEPS + 1.0)).clamp(0.0, 1.0)
    progress = torch.where(gait.stepping, progress, 0.0)
    side = torch.where(gait.swing == 1, _SWAY_RAD, -_SWAY_RAD).double()
    cue = (side * (2.0 * progress - 1.0), _PITCH_RAD_M * command[:, 0], command[:, 2])
    return torch.stack(cue, dim=1)


def read(gait: Gait, neck: Tensor, command: Tensor) -> Tensor:
    """[n, 3]: the step command, its length and turn replaced by those that the neck [n, 3] rad
    shows, where the cue is readable."""
    length = (neck[:, 1] / _PITCH_RAD_M).clamp(*_LENGTH_M)
    turn = neck[:, 2].clamp(-_TURN_RAD, _TURN_RAD)
    shown = torch.stack((length, command[:, 1], turn), dim=1)
    readable = gait.stepping & (gait.landed | (gait.time >= _READ_FROM))
    return torch.where(readable[:, None], shown, command)


def first_foot(gait: Gait, neck: Tensor) -> Tensor:
    """[n]: the swing foot or the next one; during a weight shift the foot that the neck [n, 3] rad
    shows. An observing teacher would otherwise label with the other foot as long as the student
    hesitates."""
    sway = neck[:, 0]
    clear = (sway.abs() > _SWAY_READ_RAD[0]) & (sway.abs() < _SWAY_READ_RAD[1])
    readable = (gait.mode == SHIFT) & (gait.time >= _SHIFT_READ_FROM) & clear
    return torch.where(readable, (sway < 0.0).long(), gait.swing)
