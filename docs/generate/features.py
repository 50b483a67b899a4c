"""The page of features and goals: every input number of a policy with its formula."""

import numpy as np

from docs.generate.markdown import code, table
from world.character import formulas
from world.character import model as character
from world.character.features import STATE, Table
from world.tasks import REGISTRY

INTRODUCTION = """# Features and goals

A policy observes the **state** ({width} numbers, the same for every task) followed by the **goal**
of its task. The tables have the index and the formula of each number, so that any engine can
compute the inputs. Formulas are numpy expressions over the quantities below; `np` is numpy, `@` the
matrix product. A test evaluates this page and compares it with the package to 1e-5.

Units are SI. World and object frames have z up; body frames have x forward, y left, z up.
Quaternions are w, x, y, z. The **heading frame** has its origin at the root, x along the root's
heading and z up. [Axis conventions](../how-to/axes.md) has the mapping from Unity, Unreal and
Blender.

The observation normaliser is part of the policy: the service and ONNX files take these numbers
without normalisation.
"""


def page() -> str:
    """Inputs, definitions, the state, the goal of each task, and the mapping of actions."""
    parts = [INTRODUCTION.format(width=STATE.width)]
    parts += ["## Inputs of the character\n", _inputs(formulas.CHARACTER)]
    parts += ["## Inputs of the scene\n", _inputs(formulas.SCENE)]
    parts += [
        "## Definitions\n",
        "Each uses only inputs and earlier definitions.\n",
        table(
            ("name", "shape", "unit", "meaning", "expression"),
            (
                (code(d.name), d.shape, d.unit, d.meaning, code(d.expression))
                for d in formulas.definitions()
            ),
        ),
    ]
    parts += [f"## State, {STATE.width} numbers\n", _features(STATE)]
    for name, task in REGISTRY.items():
        parts += [f"## Goal of {name}, {task.goal.width} numbers\n", _features(task.goal)]
        if task.sides is not None:
            parts.append(
                f"The networks of {name} act on one canonical side: where `{task.sides[1]}` points"
                f" to the right of `{task.sides[0]}` (the z component of their cross product is"
                " negative), the policy mirrors the observation before the network and the action"
                " after it. The service and ONNX files include the mirroring.\n"
            )
    parts += ["## Actions\n", ACTIONS, _actions()]
    return "\n".join(parts)


ACTIONS = """An action is 28 numbers, one per servo. The set-point of a servo is

```
a = clip(action, -action_clip, action_clip)
set_point = clip(neutral + action_scale * (high - low) * a, low, high)
```

with `action_scale` and `action_clip` of the policy's own configuration (`world.action_scale`,
`world.action_clip`). A ball joint has three servos, for x, y and z of the rotation vector of its
body in the parent's frame; a hinge has one. Torque = kp (set-point − position) − kd velocity; the
effort limit holds at each control step (30 Hz): the set-point is moved to where the torque is at
its limit.
"""


def _inputs(quantities: tuple[formulas.Quantity, ...]) -> str:
    rows = ((code(q.name), q.shape, q.unit, q.meaning) for q in quantities)
    return table(("name", "shape", "unit", "meaning"), rows)


def _features(features: Table) -> str:
    rows, start = [], 0
    for f in features:
        last = start + f.width - 1
        place = f"{start}" if f.width == 1 else f"{start}-{last}"
        rows.append((place, code(f.name), f.frame, f.unit, f.meaning or code(f.formula)))
        start += f.width
    return table(("numbers", "name", "frame", "unit", "formula"), rows)


def _actions() -> str:
    low, high = character.set_point_bounds()
    neutral = character.neutral_set_points()
    kp, kd = character.gains()
    names = [
        joint.name + (f"_{'xyz'[axis]}" if joint.is_ball else "")
        for joint in character.JOINTS
        for axis in range(len(joint.range_deg))
    ]
    values = np.stack((neutral, low, high, kp, kd, character.effort_limits()), axis=1)
    rows = (
        (str(i), code(name), *(f"{v:.6g}" for v in row))
        for i, (name, row) in enumerate(zip(names, values, strict=True))
    )
    heads = ("number", "servo", "neutral, rad", "low, rad", "high, rad")
    return table((*heads, "kp, N·m/rad", "kd, N·m·s/rad", "limit, N·m"), rows)
