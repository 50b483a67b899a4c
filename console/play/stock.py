"""Policies of the player by name, and the pieces that each can use."""

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
    """Policies, and the set of their furniture."""

    policies: dict[str, Served]
    objects: str = "test"
    """As in `inhabit evaluate`: test, train, or a file or folder of imported pieces."""

    def policy(self, name: str) -> Served:
        """Return a policy by name; ChoiceError names the valid ones."""
        if name not in self.policies:
            raise ChoiceError("policy", name, list(self.policies))
        return self.policies[name]

    @cached_property
    def _pieces(self) -> dict[str, dict[str, Piece]]:
        return {}

    def pieces(self, policy: str) -> dict[str, Piece]:
        """Return the pieces that a policy can use, by name, unscaled."""
        affordance = self.policy(policy).task.affordance
        if affordance.name not in self._pieces:
            self._pieces[affordance.name] = affordance.choices(self.objects)
        return self._pieces[affordance.name]

    def piece(self, policy: str, name: str, scale: float) -> Piece:
        """Return a scaled piece; ChoiceError names the valid ones."""
        served, pieces = self.policy(policy), self.pieces(policy)
        if name not in pieces:
            raise ChoiceError("piece", name, list(pieces))
        return served.task.affordance.chosen(pieces[name], scale)

    def first(self) -> Setup:
        """Return the initial setup."""
        policy = next(iter(self.policies))
        return Setup(policy, next(iter(self.pieces(policy))))

    def begin(self, setup: Setup) -> Live:
        """Return the scene of a setup in its initial state; InhabitError for an invalid setup."""
        piece = self.piece(setup.policy, setup.piece, setup.scale)
        return Live(Scene(self.policy(setup.policy), piece, setup))


def load(words: Sequence[str], which: loading.Which, objects: str) -> Stock:
    """Return the stock of RUN and NAME=RUN words; InhabitError, in one line, for an invalid one."""
    policies: dict[str, Served] = {}
    for word in words:
        name, equals, where = word.partition("=")
        path = loading.checkpoint_of(Path(where) if equals else Path(word), which)
        name = name if equals else loading.task_of(path)
        if not name:
            raise ConfigError(f"'{word}': must be RUN or NAME=RUN")
        if name in policies:
            again = f"{name}2={where if equals else word}"
            raise ConfigError(f"two policies have the name '{name}': give one, as {again}")
        policies[name] = loading.served(name, path).check()
    return Stock(policies, objects)
