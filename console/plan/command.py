"""`inhabit plan`: what a cluster would give, before it is paid for."""

from dataclasses import asdict, replace
from typing import Any

from rich.table import Table

from console.commands.tools import Plan
from console.plan.estimate import Costs, Estimate, Fleet, best_actors, estimate
from console.run import machine
from console.run.directory import write_json
from console.run.experiment import PRESETS, Experiment
from console.terminal import screen
from world import tasks
from world.errors import ConfigError

#: Share of the greatest rate that the recommended number of actors gives at least.
_SHARE = 0.9


def plan_command(command: Plan) -> int:
    """Print the estimate and write its JSON; return the exit code."""
    output = screen()
    experiment = experiment_of(command)
    fleet = fleet_of(command, experiment)
    costs = Costs()
    source = "two quiet cores, the task sit (docs/results/throughput.md)"
    if command.measure:
        from console.plan.measuring import measure  # imports the learner

        output.print(f"measuring this machine for {command.seconds:.0f} s")
        costs = measure(experiment, fleet, command.seconds)
        source = f"this machine, {command.task} (receiving: docs/results/throughput.md)"
    found = estimate(fleet, costs)
    enough = best_actors(fleet, costs, experiment.block, _SHARE)
    figures = {
        "fleet": asdict(fleet),
        "costs": asdict(costs) | {"source": source},
        "estimate": asdict(found),
        "enough_actors": enough,
        "bill": bill(command, found),
    }
    output.print(table(fleet, found, enough, figures["bill"], source))
    if command.json is not None:
        write_json(command.json, figures)
    return 0


def experiment_of(command: Plan) -> Experiment:
    """Return the experiment that is planned; ConfigError for sizes that cannot be."""
    tasks.make(command.task)
    preset = PRESETS[command.preset]
    hidden = command.network or preset.ppo.hidden
    scenes = command.scenes or command.actors * preset.scenes // 2
    blocks = scenes // preset.block
    if scenes % preset.block or blocks < command.actors:
        raise ConfigError(
            f"--scenes {scenes} over --actors {command.actors}: every actor needs a whole block of"
            f" {preset.block}: choose --scenes {max(command.actors, blocks) * preset.block}"
        )
    return replace(
        preset,
        scenes=scenes,
        horizon=command.horizon or preset.horizon,
        world=replace(preset.world, task=command.task),
        ppo=replace(preset.ppo, hidden=tuple(hidden), threads=min(2, machine.cores())),
    )


def fleet_of(command: Plan, experiment: Experiment) -> Fleet:
    """Return the fleet of the flags."""
    return Fleet(
        actors=command.actors,
        scenes=experiment.scenes,
        horizon=experiment.horizon,
        epochs=experiment.ppo.epochs,
        hidden=experiment.ppo.hidden,
        goal=tasks.make(command.task).goal.width,
        style=experiment.ppo.style_weight > 0.0,
        replay=experiment.style.replay,
        overlap=command.overlap,
        learner_cores=command.learner_cores,
        gbit_per_s=command.gbit_per_s,
    )


def bill(command: Plan, found: Estimate) -> dict[str, float]:
    """Return hours, core hours and cost of the planned number of samples."""
    hours = command.samples / found.samples_per_s / 3600.0
    cores = command.actors + command.learner_cores + 1  # one for the style service
    return {
        "samples": float(command.samples),
        "hours": hours,
        "core_hours": cores * hours,
        "cost": cores * hours * command.price,
    }


def table(
    fleet: Fleet, found: Estimate, enough: int, costs: dict[str, float], source: str
) -> Table:
    """Return the estimate as a table: what, how much, how it comes about."""
    made = Table("", "", "how", title=f"costs of a sample: {source}", title_justify="left")
    mode = "the longer of actors and learner" if fleet.overlap else "actors, then the learner"
    rows: list[tuple[str, str, str] | None] = [
        ("samples/s", f"{found.samples_per_s:,.0f}", f"{found.to_ideal:.0%} of the actors' own"),
        ("limited by", found.bottleneck, f"{enough} actors give {_SHARE:.0%} of the most"),
        None,
        ("actors", f"{found.rollout_s:.3f} s", f"{fleet.scenes:,} scenes x {fleet.horizon} steps"),
        ("intake", f"{found.intake_s:.3f} s", f"{fleet.actors} parts, {_mb(found.rollout_bytes)}"),
        ("style", f"{found.style_s:.3f} s", "scoring; training where it is longer than the update"),
        ("update", f"{found.update_s:.3f} s", f"{fleet.weights:,} weights an actor network"),
        ("iteration", f"{found.iteration_s:.3f} s", mode),
        None,
        ("network", f"{_mb(found.network_bytes_per_s)}/s", f"weights {_mb(found.weight_bytes)}"),
        ("memory, learner", _mb(found.learner_memory_bytes), "with the style service"),
        ("memory, actor", _mb(found.actor_memory_bytes), "each"),
        None,
        (f"{costs['samples'] / 1e6:,.0f} M samples", f"{costs['hours']:,.1f} h", _money(costs)),
    ]
    for row in rows:
        if row is None:
            made.add_section()
        else:
            made.add_row(*row)
    return made


def _mb(size: float) -> str:
    return f"{size / 1e6:,.1f} MB"


def _money(costs: dict[str, Any]) -> str:
    paid = f", {costs['cost']:,.2f} at the price given" if costs["cost"] else ""
    return f"{costs['core_hours']:,.0f} core hours{paid}"
