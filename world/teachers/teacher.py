"""The Teacher protocol: labels the scenes of a shard with the actions that a student imitates."""

from collections.abc import Mapping
from typing import Protocol

from torch import Tensor

from world.scene.batch import Scenes
from world.scene.target import Target

#: What a learner publishes once no label counts any more, which costs a third of the simulation.
UNTAUGHT = "untaught"


class Teacher(Protocol):
    """An observing teacher of n scenes: the student drives, the teacher labels its states.

    A teacher may keep state from step to step. `label` is therefore called exactly once in each
    control step, before the scenes advance, and `reset` for each new episode.
    """

    def reset(self, rows: Tensor, target: Target) -> None:
        """Begin new episodes in the scenes `rows` [m], whose objects are at `target` [m]."""
        ...

    def label(self, scenes: Scenes, target: Target, variant: Tensor, clock: int) -> Tensor:
        """Teacher actions [n, 28] float32 in the scenes' present states, NaN where it labels
        nothing.

        target [n]; variant [n]: the object of each scene, by number in the bank; clock: control
        steps since the shard was made.
        """
        ...

    def state_dict(self) -> dict[str, Tensor]:
        """What an exact continuation needs, by name."""
        ...

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        ...
