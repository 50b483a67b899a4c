"""Mixtures: scenes of several tasks that train one policy.

The networks observe one goal, the union of the tasks' goals by feature name, and marks that tell
the task. In tracking scenes the policy may see another task's goal in place of the reference, which
the critic alone sees: then tracking teaches that task (hybrid imitation, arXiv:2505.12619).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from world import tasks
from world.character.features import STATE, Feature, Table
from world.config import WorldConfig
from world.errors import ConfigError
from world.reflection import Reflection, Symmetry
from world.tasks.symmetry import actions, symmetry
from world.tasks.task import Task

#: Prefix of the features that tell the task.
MARK = "task_"


@dataclass(frozen=True)
class Mixture:
    """Tasks that share scenes and networks; the first one is what the policy is for."""

    parts: tuple[Task, ...]
    counts: tuple[int, ...]
    """Of each task: scenes in a block."""
    shown: tuple[tuple[Task, ...], ...]
    """Of each task: the tasks whose goals its scenes observe, one after the other."""
    goal: Table
    """The union of the goals, then the marks."""
    columns: tuple[Tensor, ...]
    """Of each task, int64: the column in `goal` of each number that its scenes observe."""
    hidden: Tensor
    """[goal.width] bool: columns that the critic alone observes."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the tasks."""
        return tuple(part.name for part in self.parts)

    @cached_property
    def marks(self) -> Tensor:
        """[tasks, goal.width]: the goals of the tasks' scenes with all features but the marks 0."""
        rows = torch.zeros(len(self.parts), self.goal.width)
        for row, part, shown in zip(rows, self.parts, self.shown, strict=True):
            for task in {part.name, shown[0].name}:
                row[self.goal.slice(MARK + task)] = 1.0
        return rows

    def embed(self, part: int, goals: Tensor) -> Tensor:
        """Return mixed goals [..., goal.width] of goals [..., g] that scenes of a part observe."""
        rows = self.marks[part].to(goals.device).expand(*goals.shape[:-1], -1).clone()
        rows[..., self.columns[part].to(goals.device)] = goals
        return rows

    def scenes(self, part: int, scenes: range, block: int) -> list[int]:
        """Return the ids of a part's scenes among `scenes`, whole blocks: each block begins with
        those of the first task."""
        first = sum(self.counts[:part])
        inside = range(first, first + self.counts[part])
        return [scene for scene in scenes if scene % block in inside]

    def own(self, name: str) -> Tensor:
        """Return the columns [g] of a task's own goal; ConfigError where the policy does not see
        it."""
        part = self.number(name)
        columns = self.columns[part][-self.parts[part].goal.width :]
        if bool(self.hidden[columns].any()):
            raise ConfigError(
                f"the policy of this mixture never sees the goal of {name}: choose"
                f" {', '.join(n for n in self.names if n != name)}"
            )
        return columns

    def number(self, name: str) -> int:
        """Return the index of a task; ConfigError lists those that there are."""
        if name not in self.names:
            raise ConfigError(f"task {name} is not in the mixture: choose {', '.join(self.names)}")
        return self.names.index(name)

    def equivalents(self, name: str) -> dict[str, str]:
        """Return, of each feature of the mixed goal, its name in the goal of the task `name`; empty
        where that lacks it."""
        theirs = {_shared_name(tasks.make(name), f): f.name for f in tasks.make(name).goal}
        return {feature.name: theirs.get(feature.name, "") for feature in self.goal}

    @cached_property
    def symmetry(self) -> Symmetry:
        """The reflections of observations (state and mixed goal) and actions; networks of a mixture
        act on both sides."""
        width = STATE.width
        index = torch.arange(width + self.goal.width)
        sign = torch.ones(len(index))
        for part in self.parts:
            mine = symmetry(part).observation
            columns = width + self.columns[self.number(part.name)][-part.goal.width :]
            both = torch.cat((torch.arange(width), columns))
            index[both], sign[both] = both[mine.index], mine.sign.to(sign.dtype)
        return Symmetry(Reflection(index, sign), actions())

    def worlds(self, world: WorldConfig) -> tuple[WorldConfig, ...]:
        """Return the settings of each task's scenes."""
        return tuple(
            replace(
                world,
                task=part.name,
                episode_s=_episode_s(world, part, self.parts[0]),
                classes=world.classes or part.affordance.classes,
            )
            for part in self.parts
        )


def mixture(shares: Mapping[str, float], block: int, shown: str = "") -> Mixture:
    """Return the mixture of tasks by their shares of the scenes, which need not sum to 1.

    shown: name of the task whose goal the policy sees in scenes of the task track; empty: that of
    track. Raises ChoiceError for an unknown task, ConfigError for shares that give a task no scene
    of a block, and for a task that cannot be shown.
    """
    parts = tuple(tasks.make(name) for name in shares)
    if len(parts) < 2:
        raise ConfigError("--mix: name two tasks or more, each with its share: track=0.5 carry=0.5")
    if any(not share > 0.0 for share in shares.values()):
        raise ConfigError("--mix: every share must be above 0")
    following = [part.affordance.follows_clips for part in parts]
    if shown and not (shown in shares and any(following)):
        raise ConfigError(
            f"--world.track.goal {shown}: the mixture needs the tasks track and {shown}: add them"
            " to --mix"
        )
    first, width = {}, 0
    goal: list[Feature] = []
    columns = []
    for part in parts:
        mine: list[int] = []
        for feature in part.goal:
            name = _shared_name(part, feature)
            if (name, feature.width) not in first:
                first[name, feature.width] = width
                goal.append(replace(feature, name=name))
                width += feature.width
            at = first[name, feature.width]
            mine += range(at, at + feature.width)
        columns.append(torch.tensor(mine))
    goal += [Feature(MARK + part.name, 1, "", "0 or 1", meaning=_MARKED) for part in parts]
    table = Table("goal", *goal)
    hidden = torch.zeros(table.width, dtype=torch.bool)
    observed: list[tuple[Task, ...]] = [(part,) for part in parts]
    if shown:
        track, leader = following.index(True), list(shares).index(shown)
        if leader == track:
            raise ConfigError(f"--world.track.goal: name a task other than {shown}")
        hidden[columns[track]] = True
        hidden[table.slice(MARK + parts[track].name)] = True
        # what another task of the mixture observes as well is not hidden
        others = [c for part, c in enumerate(columns) if part != track]
        hidden[torch.cat(others)] = False
        columns[track] = torch.cat((columns[leader], columns[track]))
        observed[track] = (parts[leader], parts[track])
    return Mixture(parts, _counts(shares, block), tuple(observed), table, tuple(columns), hidden)


_MARKED = "1 in scenes of this task"


def shares(mix: Sequence[str], task: str) -> dict[str, float]:
    """Return the shares of `--mix TASK=SHARE ...` by task, `task` first.

    Raises ConfigError, which names the valid form, for anything else.
    """
    found: dict[str, float] = {}
    for item in mix:
        name, _, share = item.partition("=")
        try:
            number = float(share)
        except ValueError:
            number = -1.0
        if not 0.0 < number < float("inf") or name in found:
            raise ConfigError(
                f"--mix {item}: write each task once, with its share of the scenes, as in"
                " track=0.5 carry=0.5"
            )
        tasks.make(name)
        found[name] = number
    if found and task not in found:
        raise ConfigError(f"--mix: {task}, which is trained, has no share: add {task}=SHARE")
    first = {task: found[task]} if found else {}
    return first | found


def is_mixed(goal: Sequence[tuple[str, int]]) -> bool:
    """True for the goal of a mixture, by the names and widths of its features."""
    return any(name.startswith(MARK) for name, _ in goal)


def _shared_name(task: Task, feature: Feature) -> str:
    """Return the name of a task's feature in a mixed goal: the equivalent's in other tasks."""
    return task.equivalents.get(feature.name, feature.name) or f"{task.name}_{feature.name}"


def _counts(wanted: Mapping[str, float], block: int) -> tuple[int, ...]:
    """Return the scenes of a block by task, by largest remainder."""
    total = sum(wanted.values())
    exact = [block * share / total for share in wanted.values()]
    counts = [int(number) for number in exact]
    order = sorted(range(len(exact)), key=lambda i: counts[i] - exact[i])
    for i in order[: block - sum(counts)]:
        counts[i] += 1
    if min(counts) < 1:
        name = list(wanted)[counts.index(0)]
        raise ConfigError(
            f"--mix: the share of {name} is less than one scene of a block of {block}: raise it"
        )
    return tuple(counts)


def _episode_s(world: WorldConfig, part: Task, first: Task) -> float:
    """Return the length of a part's episodes: a setting is meant for the first task."""
    if part is first and world.episode_s is not None:
        return world.episode_s
    return part.episode_s
