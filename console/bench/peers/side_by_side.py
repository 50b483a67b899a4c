"""`bench peers` and `bench learning` from the command line."""

from collections.abc import Callable, Mapping
from typing import Any

from console.commands import Bench
from console.run.experiment import Experiment

Found = tuple[dict[str, float], dict[str, Any]]


def peers(command: Bench, experiment: Experiment, threads: int) -> Found:
    """Measure whole iterations against those of other libraries on the same scenes."""
    from console.bench.peers import alternation

    return alternation.measure(
        experiment,
        threads,
        command.seconds,
        command.rounds,
        command.peer_python,
        actors=command.fleet_actors,
    )


def learning(
    command: Bench,
    experiment: Experiment,
    threads: int,
    save: Callable[[Mapping[str, float], Mapping[str, Any]], None],
) -> Found:
    """Measure the returns of ours and of other libraries at equal samples; `save` receives figures
    and details whenever a training is complete."""
    from console.bench.peers import learning as study

    return study.measure(
        experiment,
        threads,
        command.samples,
        command.seeds,
        command.only,
        command.peer_python,
        command.json,
        save,
    )
