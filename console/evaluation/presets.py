"""Evaluation protocols by name, and the published results of each task."""

from dataclasses import dataclass
from typing import Literal

from world import tasks
from world.tasks.evaluation import Published

Name = Literal["table1", "table3", "weights"]


@dataclass(frozen=True)
class Preset:
    """Initial distances of the trials, m, and a description."""

    near_m: float
    far_m: float
    about: str


PRESETS: dict[Name, Preset] = {
    "table1": Preset(1.0, 10.0, "the paper's own protocol (Tables 1 and 2)"),
    # The paper gives no distance for this comparison; its times (3.7 s against 5.0 s for sit)
    # suggest a shorter one. 5 m is our choice.
    "table3": Preset(1.0, 5.0, "the comparison with kinematic methods (Table 3), from 1-5 m"),
    "weights": Preset(1.0, 10.0, "Table 1's fourth row: carry, boxes of one size and 1-12 kg"),
}


def start_m(task: str, protocol: Name) -> tuple[float, float]:
    """Return the smallest and largest initial distance of a task's trials, m."""
    preset = PRESETS[protocol]
    return tasks.make(task).evaluation.start_m.get(protocol, (preset.near_m, preset.far_m))


def published(task: str, protocol: Name, perturbation: str) -> tuple[Published, ...]:
    """Return the published results to compare with; empty without any."""
    if task not in tasks.REGISTRY:
        return ()
    known = tasks.make(task).evaluation
    return known.perturbed if perturbation != "none" else known.published.get(protocol, ())
