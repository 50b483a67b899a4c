"""A shard of scenes of several tasks (world.tasks.mixture), for one policy."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import torch
from torch import Tensor

from world.episodes import state_keys
from world.episodes.shard import Step
from world.initial.reference import KINDS
from world.tasks.mixture import Mixture

#: Statistic of an episode by which it is told which task, and which initial state, it had.
_START = "start"


class Part(Protocol):
    """The scenes of one task; a Shard is one."""

    @property
    def clock(self) -> int:
        """Control steps so far."""
        ...

    def observe(self) -> tuple[Tensor, Tensor]:
        """States [m, 114] and goals [m, g]."""
        ...

    def update_sampling(self, published: Mapping[str, Tensor]) -> None:
        """Adapt the sampling of initial states."""
        ...

    def step(self, action: Tensor) -> Step:
        """One control step with actions [m, 28]."""
        ...

    def state_dict(self) -> dict[str, Tensor]:
        """All that an exact continuation needs."""
        ...

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore it."""
        ...


class MixedShard:
    """Scenes of several tasks that step together, each task in a shard of its own."""

    def __init__(self, mixture: Mixture, parts: Sequence[Part], places: Sequence[Tensor]) -> None:
        """places: of each task, int64: the places of its scenes among the n scenes of this
        shard."""
        self._mixture, self._parts, self._places = mixture, tuple(parts), tuple(places)
        self.n = sum(len(place) for place in places)
        self._observe()

    @property
    def clock(self) -> int:
        """Control steps so far."""
        return self._parts[0].clock

    def observe(self) -> tuple[Tensor, Tensor]:
        """The current states [n, 114] and mixed goals [n, G]; overwritten by the next step."""
        return self._state, self._goal

    def update_sampling(self, published: Mapping[str, Tensor]) -> None:
        """Adapt the sampling of every task's initial states."""
        for part in self._parts:
            part.update_sampling(published)

    def step(self, action: Tensor) -> Step:
        """One control step with actions [n, 28]."""
        steps = [part.step(action[p]) for part, p in zip(self._parts, self._places, strict=True)]
        self._observe()
        ends = torch.cat(
            [place[step.end_ids] for step, place in zip(steps, self._places, strict=True)]
        )
        order = torch.argsort(ends)
        terms = action.new_zeros(self.n, sum(step.terms.shape[1] for step in steps))
        first = 0
        for step, place in zip(steps, self._places, strict=True):
            terms[place, first : first + step.terms.shape[1]] = step.terms
            first += step.terms.shape[1]
        goals = [self._mixture.embed(k, step.end_goals) for k, step in enumerate(steps)]
        labels = [step.teacher_action for step in steps]
        return Step(
            reward=self._all([step.reward for step in steps]),
            terms=terms,
            fell=self._all([step.fell for step in steps]),
            timed_out=self._all([step.timed_out for step in steps]),
            finite=self._all([step.finite for step in steps]),
            end_ids=ends[order],
            end_states=torch.cat([step.end_states for step in steps])[order],
            end_goals=torch.cat(goals)[order],
            episodes={name: value[order] for name, value in _episodes(steps).items()},
            broken=torch.cat([step.broken for step in steps]),
            teacher_action=self._labels(action, labels),
        )

    def _observe(self) -> None:
        seen = [part.observe() for part in self._parts]
        self._state = self._all([state for state, _ in seen])
        self._goal = self._all([self._mixture.embed(k, goal) for k, (_, goal) in enumerate(seen)])

    def _all(self, values: Sequence[Tensor]) -> Tensor:
        """One tensor of all scenes, from those of the tasks'."""
        found = values[0].new_zeros(self.n, *values[0].shape[1:])
        for value, place in zip(values, self._places, strict=True):
            found[place] = value
        return found

    def _labels(self, action: Tensor, labels: Sequence[Tensor | None]) -> Tensor | None:
        """The teachers' actions; NaN in the scenes of tasks without one."""
        if all(label is None for label in labels):
            return None
        found = torch.full_like(action, torch.nan)
        for label, place in zip(labels, self._places, strict=True):
            if label is not None:
                found[place] = label
        return found

    def state_dict(self) -> dict[str, Tensor]:
        """All that an exact continuation needs: of each task what its shard names, with rows for
        all scenes, so that any division of the scenes can continue it."""
        found = {}
        names = self._mixture.names
        for name, part, place in zip(names, self._parts, self._places, strict=True):
            for key, value in part.state_dict().items():
                if value.ndim and len(value) == len(place):
                    rows = value.new_zeros(self.n, *value.shape[1:])
                    rows[place] = value
                    value = rows
                found[f"{name}.{key}"] = value
        return found

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        names = self._mixture.names
        for name, part, place in zip(names, self._parts, self._places, strict=True):
            own = state_keys.part(state, f"{name}.")
            part.load_state_dict(
                {k: v[place] if v.ndim and len(v) == self.n else v for k, v in own.items()}
            )
        self._observe()


def kinds(mixture: Mixture) -> tuple[str, ...]:
    """Names of the categories of initial states of a mixture: task and category."""
    return tuple(f"{name}_{kind}" for name in mixture.names for kind in KINDS)


def _episodes(steps: Sequence[Step]) -> dict[str, Tensor]:
    """Statistics of the episodes that ended, task after task; NaN for those that a task lacks."""
    names = list(dict.fromkeys(name for step in steps for name in step.episodes))
    found = {}
    for name in names:
        values = []
        for k, step in enumerate(steps):
            value = step.episodes.get(name)
            if value is None:
                value = torch.full_like(step.episodes[_START], torch.nan)
            values.append(value + k * len(KINDS) if name == _START else value)
        found[name] = torch.cat(values)
    return found
