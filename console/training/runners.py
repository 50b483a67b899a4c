"""The two runners: one process with threads, or Ray actors with the style service beside them."""

import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from actors.local import LocalFleet
from actors.processes import ProcessFleet
from console.commands import Train
from console.commands.training import StyleAddress
from console.run import assembly
from console.run.directory import RunDirectory
from console.run.experiment import Experiment
from console.training.style_service import attached
from discriminator.client import StyleClient
from discriminator.process import start_process
from learner.protocols import Fleet, Style
from rpc.channel import ChannelConfig
from world.errors import ConfigError
from world.initial.furniture import KINDS


@dataclass(frozen=True)
class Runner:
    """What a loop drives."""

    fleet: Fleet
    style: Style | None
    """None: the task reward alone."""
    starts: tuple[str, ...]
    """Names of the kinds of start, in the order of their numbers in `episodes`."""


@contextmanager
def open_runner(
    command: Train,
    experiment: Experiment,
    run: RunDirectory,
    workers: int,
    say: Callable[[str], None],
) -> Iterator[Runner]:
    """The runner that the flags ask for; closed on the way out, whatever happens.

    say: gets a line for what goes wrong and is mended, such as a service that died.
    """
    if command.style_service.address and command.runner != "ray":
        raise ConfigError("--style-service.address is for many processes: add --runner ray")
    if command.runner == "ray":
        address, style = command.address, command.style_service
        with ray_runner(experiment, run, workers, address, say, style) as runner:
            yield runner
    else:
        with local_runner(experiment, run, workers) as runner:
            yield runner


@contextmanager
def local_runner(experiment: Experiment, run: RunDirectory, workers: int) -> Iterator[Runner]:
    """Everything in this process, but for workers beyond the first: a process each."""
    kind = LocalFleet if workers == 1 else ProcessFleet
    fleet = kind(assembly.make_shard(experiment, run), *_shape(experiment, workers))
    try:
        styled = experiment.ppo.style_weight > 0.0
        yield Runner(fleet, assembly.discriminator(experiment) if styled else None, KINDS)
    finally:
        fleet.close()


@contextmanager
def ray_runner(
    experiment: Experiment,
    run: RunDirectory,
    workers: int,
    address: str | None,
    say: Callable[[str], None],
    style: StyleAddress,
) -> Iterator[Runner]:
    """Ray actors, and the style service in a process of its own, or at an address."""
    from actors.cluster import ray_session  # a second that the local runner can do without
    from actors.fleet import RayFleet

    with ExitStack() as stack:
        found = attached(style, experiment, say) if style.address else None
        client = stack.enter_context(found or style_client(experiment, run, say))
        stack.enter_context(ray_session(workers, address))
        fleet = RayFleet(assembly.make_shard(experiment, run), *_shape(experiment, workers))
        stack.callback(fleet.close)
        yield Runner(fleet, client, KINDS)


@contextmanager
def style_client(
    experiment: Experiment, run: RunDirectory, say: Callable[[str], None]
) -> Iterator[StyleClient]:
    """A style service of this run's own, on a free port, and its client."""
    journal = run.path / "style"
    # A journal of an earlier session would be ahead of, or behind, the checkpoint to go on from.
    shutil.rmtree(journal, ignore_errors=True)
    spec = assembly.style_service(experiment, state=str(journal))
    process = start_process(spec, say)
    try:
        channel = ChannelConfig(address=process.address)
        client = StyleClient(channel, say, lost=lambda: process.lost)
        try:
            yield client
        finally:
            client.close()
    finally:
        process.stop()
        shutil.rmtree(journal, ignore_errors=True)


def _shape(experiment: Experiment, workers: int) -> tuple[int, int, int, int, int]:
    """Scenes, block, workers, seed, horizon: what both fleets are made from."""
    return (
        experiment.scenes,
        experiment.block,
        workers,
        experiment.seed,
        experiment.horizon,
    )
