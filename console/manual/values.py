"""Words that complete the value of a flag: enumerated values, policies, runs and files."""

from dataclasses import dataclass

import pretrained
from console.commands import Distill
from console.manual.fields import Field
from console.run import recipe
from world.meshes.collection import SPLITS

#: Fields whose value names a piece's split, or files of pieces.
_SPLITS = ("objects",)
_SOURCES = ("source", "sources", "policies", "init", "walker", "tracker", "expert", "rollouts")


@dataclass(frozen=True)
class Values:
    """What completes one value."""

    words: tuple[str, ...] = ()
    files: bool = False
    """Files and folders too."""
    runs: bool = False
    """Folders in `runs` that hold a run, too."""


def of(field: Field) -> Values:
    """Return what completes the values of a flag or word; nothing for numbers and free text."""
    name = field.own_name
    if field.choices:
        return Values(field.choices)
    if name == "task" and field.owner is Distill:
        return Values(distilled())
    if name == "task":
        return Values(tasks())
    if name == "mix":
        return Values(tuple(f"{task}=" for task in tasks()))
    if name == "recipe":
        return Values(tuple(recipe.names()), files=True)
    if name in _SPLITS:
        return Values(SPLITS, files=True)
    if name in _SOURCES:
        return Values(tuple(pretrained.names()), files=True, runs=True)
    if name == "run":
        return Values(runs=True, files=True)
    if field.kind.startswith("path") or field.word in ("IN", "FILE", "PATH", "PATH ..."):
        return Values(files=True)
    if field.positional and field.kind.startswith("text"):
        return Values(SPLITS, files=True)
    return Values()


def tasks() -> tuple[str, ...]:
    """Return the names of the tasks."""
    # imported here: it takes a second, which no help needs
    from world.tasks import REGISTRY

    return tuple(REGISTRY)


def distilled() -> tuple[str, ...]:
    """Return the names of the tasks that policies teach."""
    # imported here, as above
    from console.run.policy_teachers import WALKERS

    return WALKERS
