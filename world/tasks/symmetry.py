"""Reflections of feature tables and actions in the plane y = 0 of the heading frame.

Positions, velocities and axes of bodies change the sign of y; rotation vectors and angular
velocities, which are axial, change those of x and z; features of a right limb are exchanged with
those of the left one.
"""

import torch

from world.character import model as character
from world.character.features import STATE, Feature, Table
from world.reflection import Reflection, Symmetry
from world.tasks.task import Task

_POLAR, _AXIAL = (1.0, -1.0, 1.0), (-1.0, 1.0, -1.0)
#: Of a box's corners, x slowest and z fastest: those at the other end of y.
_CORNERS = (2, 3, 0, 1, 6, 7, 4, 5)


def symmetry(task: Task) -> Symmetry:
    """The reflections of a task's observations (state and goal) and actions, with its sides."""
    sides = None
    if task.sides is not None:
        starts = [STATE.width + task.goal.slice(name).start for name in task.sides]
        sides = torch.tensor([start + axis for start in starts for axis in range(2)])
    return Symmetry(_joined(_table(STATE), _table(task.goal)), actions(), sides)


def actions() -> Reflection:
    """The reflection of the 28 set-points, or of the 28 joint velocities, in joint order."""
    names = [joint.name for joint in character.JOINTS]
    first, column = {}, 0
    for joint in character.JOINTS:
        first[joint.name] = column
        column += len(joint.range_deg)
    index, sign = [], []
    for name, joint in zip(names, character.JOINTS, strict=True):
        width = len(joint.range_deg)
        partner = first[_other_side(name)]
        index += range(partner, partner + width)
        sign += _AXIAL if joint.is_ball else (1.0,)
    return _reflection(index, sign)


def _table(table: Table) -> Reflection:
    names = {feature.name for feature in table}
    index: list[int] = []
    sign: list[float] = []
    for feature in table:
        partner = _other_side(feature.name)
        start = table.slice(partner if partner in names else feature.name).start
        own_index, own_sign = _feature(feature)
        index += [start + i for i in own_index]
        sign += own_sign
    return _reflection(index, sign)


def _feature(feature: Feature) -> tuple[list[int], list[float]]:
    """For each number of a feature: index in its partner, and sign."""
    if feature.name in ("joint_velocity", "setpoint_error"):
        whole = actions()
        return whole.index.tolist(), whole.sign.tolist()
    if feature.name == "corners":
        return [3 * k + axis for k in _CORNERS for axis in range(3)], [*_POLAR] * 8
    own = list(range(feature.width))
    if feature.name == "root_angular_velocity":
        return own, [*_AXIAL]
    if feature.width == 1:  # heights, and the flexion of hinges
        return own, [1.0]
    if feature.width == 2:  # a direction on the floor
        return own, [*_POLAR[:2]]
    return own, [*_POLAR] * (feature.width // 3)


def _other_side(name: str) -> str:
    words = [{"right": "left", "left": "right"}.get(word, word) for word in name.split("_")]
    return "_".join(words)


def _joined(first: Reflection, second: Reflection) -> Reflection:
    shifted = second.index + len(first.index)
    return Reflection(torch.cat((first.index, shifted)), torch.cat((first.sign, second.sign)))


def _reflection(index: list[int], sign: list[float]) -> Reflection:
    return Reflection(torch.tensor(index), torch.tensor(sign))
