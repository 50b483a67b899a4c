"""Output of `train --dry-run`: the resolved configuration, features, goal and rewards."""

import io
import json

from rich.table import Table

from console.run.experiment import Experiment, to_json
from console.terminal import plain
from world import tasks
from world.character.features import STATE
from world.character.features import Table as Features


def describe(experiment: Experiment, width: int = 100) -> str:
    """Return all tables of an experiment as text of `width` columns."""
    console = plain(io.StringIO(), width, record=True)
    task = tasks.make(experiment.world.task)
    console.print_json(json.dumps(to_json(experiment)), indent=2)
    console.print(features(STATE, "state"))
    console.print(features(task.goal, "goal (policy and value function only)"))
    rewards = Table("term", "weight", title=f"reward of {task.name}", title_justify="left")
    for name, weight in task.terms.items():
        rewards.add_row(name, f"{weight:g}")
    weights = experiment.ppo
    rewards.add_section()
    rewards.add_row("task, of all", f"{weights.task_weight:g}")
    rewards.add_row("style, of all", f"{weights.style_weight:g}")
    console.print(rewards)
    return console.export_text().rstrip()


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
