"""What a recipe is made of: runs before its own, and stages whose settings hold until a measured
condition does."""

from dataclasses import dataclass, field
from typing import Any, Literal


@dataclass(frozen=True)
class Stage:
    """One stage: its settings, and the condition that ends it."""

    name: str
    about: str = ""
    """What is learned in it, in a sentence."""
    settings: dict[str, Any] = field(default_factory=dict)
    """Settings that differ from the run's, by dotted name; samples of a schedule such as ppo.sigma
    count from the beginning of the stage. `world.task`: a task that is learned before the run's."""
    success: dict[str, float] = field(default_factory=dict)
    """The condition: least success rate of training episodes, by category of initial state; ALL:
    of all episodes."""
    episodes: int = 2048
    """Number of last episodes, all of this stage, that the success rates are of."""
    at_least: int = 0
    """Number of samples of the stage before which the condition is not looked at."""
    limit: int = 1
    """Number of samples of the stage at which it ends although its condition does not hold."""


@dataclass(frozen=True)
class Before:
    """A run that is made before that of the recipe, which begins from the last of them."""

    name: str
    """Of its folder, and of what stands for that in later commands: {NAME}."""
    command: str
    """What follows `inhabit`: train or distill, the task and flags, without those of the place."""
    about: str = ""
    """What is learned in it, in a sentence."""
    clips: Literal["given", "own"] = "given"
    """given: those of --motions; own: the package's."""
