"""Output of `train --dry-run`: the resolved configuration, features, goal and rewards."""

import io
import json
from dataclasses import replace

from rich.table import Column, Table

from console.run import mixing, recipe
from console.run.experiment import Experiment, to_json
from console.terminal import plain
from world import tasks
from world.character.features import STATE
from world.character.features import Table as Features
from world.tasks import Task, reward


def describe(experiment: Experiment, width: int = 100) -> str:
    """Return all tables of an experiment as text of `width` columns."""
    console = plain(io.StringIO(), width, record=True)
    mixed = mixing.mixture_of(experiment)
    parts = (tasks.make(experiment.world.task),) if mixed is None else mixed.parts
    console.print_json(json.dumps(to_json(replace(experiment, before=(), stages=()))), indent=2)
    if experiment.before:
        console.print(before(experiment))
    if experiment.stages:
        console.print(stages(experiment))
    console.print(features(STATE, "state"))
    goal = parts[0].goal if mixed is None else mixed.goal
    console.print(features(goal, "goal (policy and value function only)"))
    if mixed is not None:
        shares = zip(mixed.names, mixed.counts, strict=True)
        console.print("; ".join(f"{n} of {experiment.block} scenes: {task}" for task, n in shares))
    for task in parts:
        console.print(_rewards(task, experiment, mixed is not None))
    return console.export_text().rstrip()


def before(experiment: Experiment) -> Table:
    """Return a table with one row per run that is made before that of the experiment."""
    shown = Table(
        "run", "what follows inhabit", "clips", title="made before, in RUN/before",
        title_justify="left", show_lines=True,
    )  # fmt: skip
    for one in experiment.before:
        clips = "of --motions" if one.clips == "given" else "the package's"
        shown.add_row(f"{one.name}\n{one.about}".strip(), one.command, clips)
    return shown


def stages(experiment: Experiment) -> Table:
    """Return a table with one row per stage of the experiment: what differs, and when it ends."""
    shown = Table(
        Column("stage", max_width=20), "settings that differ from those above",
        Column("ends when success", no_wrap=True), Column("at most", no_wrap=True),
        title="schedule; samples count from the beginning of each stage", title_justify="left",
        show_lines=True,
    )  # fmt: skip
    for number, stage in enumerate(experiment.stages, 1):
        settings = [f"{_typed(key)} {recipe.shown(value)}" for key, value in stage.settings.items()]
        condition = recipe.condition(stage).replace(", ", ",\n")
        when = f"{condition}\nof {stage.episodes:,} episodes"
        if stage.at_least:
            when += f"\nafter {stage.at_least / 1e6:g} M"
        name = f"{number} {stage.name}\n{stage.about}".strip()
        shown.add_row(name, "\n".join(settings), when, f"{stage.limit / 1e6:g} M")
    most = sum(stage.limit for stage in experiment.stages)
    shown.caption = f"at most {most / 1e6:g} M samples in all"
    return shown


def _typed(key: str) -> str:
    """A setting as a recipe names it."""
    return "task" if key == recipe.TASK else key.replace("_", "-")


def _rewards(task: Task, experiment: Experiment, mixed: bool) -> Table:
    rewards = Table("term", "weight", title=f"reward of {task.name}", title_justify="left")
    for name, weight in reward.weights(task, experiment.world.penalty).items():
        rewards.add_row(name, f"{weight:g}")
    weights, alone = experiment.ppo, mixed and task.affordance.follows_clips
    rewards.add_section()
    rewards.add_row("task, of all", f"{1.0 if alone else weights.task_weight:g}")
    rewards.add_row("style, of all", f"{0.0 if alone else weights.style_weight:g}")
    return rewards


def features(table: Features, title: str) -> Table:
    """Return a table with one row per feature: index, width, frame and unit."""
    shown = Table(
        "from", "width", "feature", "frame", "unit",
        title=f"{title}: {table.width} numbers", title_justify="left",
    )  # fmt: skip
    for feature in table:
        start = table.slice(feature.name).start
        shown.add_row(str(start), str(feature.width), feature.name, feature.frame, feature.unit)
    return shown
