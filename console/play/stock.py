"""What the player can choose from: policies by name, and the pieces that each can use."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from console.kinds.setup import Setup
from console.play.live import Live
from console.play.scene import Scene
from console.serving import loading
from policy.checkpoints.served import Served
from world.errors import ChoiceError, ConfigError
from world.furniture.piece import Piece


@dataclass(frozen=True)
class Stock:
    """Policies, and where their furniture comes from."""

    policies: dict[str, Served]
    objects: str = "test"
    """As of `inhabit evaluate`: test, train, or a file or folder of imported pieces."""

    def policy(self, name: str) -> Served:
        """The policy called so; ChoiceError names what there is."""
        if name not in self.policies:
            raise ChoiceError("policy", name, list(self.policies))
        return self.policies[name]

    @cached_property
    def _pieces(self) -> dict[str, dict[str, Piece]]:
        return {}

    def pieces(self, policy: str) -> dict[str, Piece]:
        """The pieces that a policy can use, by name, unscaled."""
        affordance = self.policy(policy).task.affordance
        if affordance.name not in self._pieces:
            self._pieces[affordance.name] = affordance.choices(self.objects)
        return self._pieces[affordance.name]

    def piece(self, policy: str, name: str, scale: float) -> Piece:
        """A piece at a scale; ChoiceError names what there is."""
        served, pieces = self.policy(policy), self.pieces(policy)
        if name not in pieces:
            raise ChoiceError("piece", name, list(pieces))
        return served.task.affordance.chosen(pieces[name], scale)

    def first(self) -> Setup:
        """Where the player begins."""
        policy = next(iter(self.policies))
        return Setup(policy, next(iter(self.pieces(policy))))

    def begin(self, setup: Setup) -> Live:
        """The scene of a setup at its first moment; InhabitError where there is no such scene."""
        piece = self.piece(setup.policy, setup.piece, setup.scale)
        return Live(Scene(self.policy(setup.policy), piece, setup))


def load(words: Sequence[str], which: loading.Which, objects: str) -> Stock:
    """The stock of RUN and NAME=RUN; InhabitError, in one line, for what is no run."""
    policies: dict[str, Served] = {}
    for word in words:
        name, equals, where = word.partition("=")
        path = loading.checkpoint_of(Path(where) if equals else Path(word), which)
        name = name if equals else loading.task_of(path)
        if not name:
            raise ConfigError(f"'{word}': must be RUN or NAME=RUN")
        if name in policies:
            raise ConfigError(f"two policies are called '{name}': name them, as in {name}2={word}")
        policies[name] = loading.served(name, path).check()
    return Stock(policies, objects)
