"""The terms of a training's task reward: those of the task, and penalties of motion."""

from world.config import PenaltyConfig
from world.tasks.task import Task

#: The penalties by name; each is a setting of PenaltyConfig.
PENALTIES = ("skating", "jerk", "hands")


def weights(task: Task, penalty: PenaltyConfig) -> dict[str, float]:
    """The weights of all terms by name, the task's first; penalties of weight 0 are left out."""
    return {**task.terms, **penalties(penalty)}


def penalties(penalty: PenaltyConfig) -> dict[str, float]:
    """The weights of the penalties that have one."""
    found = {name: float(getattr(penalty, name)) for name in PENALTIES}
    return {name: weight for name, weight in found.items() if weight > 0.0}
