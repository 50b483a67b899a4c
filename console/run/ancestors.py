"""The policies that another one begins from or learns from: their networks and their data."""

from collections.abc import Iterable
from pathlib import Path

from console.run import assembly, mixing
from console.run.directory import checkpoint_folder
from console.run.experiment import Experiment
from policy.checkpoints import lineage
from policy.checkpoints.format import Layout, State, read, read_manifest
from policy.checkpoints.lineage import Origin
from policy.checkpoints.transfer import adopt
from world import tasks
from world.tasks.mixture import is_mixed


def networks(source: Path, experiment: Experiment) -> tuple[Path, State, str]:
    """Return a policy's networks and normalisers as an experiment begins from them: the path of its
    checkpoint, the section `policy` in the experiment's layout, and the task that it was of.

    Of a mixture it is the policy of the experiment's task alone, or else of its first one.

    Raises LayoutError where states, actions or widths differ, RunError without a checkpoint.
    """
    path = checkpoint_folder(source)
    found, mine = read(path, ("policy",)), assembly.layout(experiment)
    state, theirs = found.state["policy"], found.manifest.layout
    task, mixed = experiment.world.task, mixing.mixture_of(experiment)
    if theirs.goal != mine.goal and is_mixed(theirs.goal):
        older = assembly.experiment_of(found.manifest, path)
        others = mixing.mixture_of(older)
        own = task if others is not None and task in others.names else ""
        older, state = mixing.of_one_task(older, state, own)
        theirs = assembly.layout(older)
    level = tasks.make(theirs.task).level
    if mixed is not None and theirs.goal != mine.goal:
        names = mixed.equivalents(theirs.task)
    elif theirs.task != mine.task:
        return path, of_other_task(state, theirs, mine, str(path)), theirs.task
    elif theirs.goal == mine.goal:
        mine.require(theirs, str(path))
        return path, state, theirs.task
    else:  # an earlier version of the same task, which lacked some features
        names, level = {}, ()
    return path, adopt(state, theirs, mine, names, str(path), level), theirs.task


def of_other_task(state: State, theirs: Layout, mine: Layout, where: str) -> State:
    """Return the section `policy` of a checkpoint of layout `theirs` in `mine`, that of another
    task: features are matched by name and by the task's equivalents.

    Raises LayoutError where states, actions or widths differ.
    """
    names, level = tasks.make(mine.task).equivalents, tasks.make(theirs.task).level
    return adopt(state, theirs, mine, names, where, level)


def origins(sources: Iterable[Path | str | None]) -> tuple[Origin, ...]:
    """Return the origins of the policies that these runs, checkpoints or names stand for."""
    return tuple(
        origin
        for source in sources
        if source
        for origin in lineage.of(read_manifest(checkpoint_folder(Path(source))).notes)
    )
