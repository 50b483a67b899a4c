"""The two runners: local worker processes, or Ray actors with a style service."""

import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import torch

from actors.local import LocalFleet, divide
from actors.processes import ProcessFleet
from actors.ray_actor import MakeShard
from console.commands import Train
from console.commands.training import StyleAddress
from console.run import assembly, mixing
from console.run.directory import RunDirectory
from console.run.experiment import Experiment
from console.training import style_service
from console.training.style_service import attached
from discriminator.client import StyleClient
from discriminator.process import start_process
from learner.protocols import Fleet, Style
from rpc.channel import ChannelConfig
from rpc.server import ServerConfig
from world.device import CPU
from world.errors import ConfigError


@dataclass(frozen=True)
class Runner:
    """Fleet and discriminator of a training loop."""

    fleet: Fleet
    style: Style | None
    """None: the task reward alone."""
    kinds: tuple[str, ...]
    """Names of the categories of initial states, in the order of their indices in `episodes`."""
    ready: Callable[[], None] = lambda: None
    """Waits until the fleet has built its scenes; raises an error of building."""


def require_shape(command: Train, experiment: Experiment, workers: int) -> None:
    """Raise ConfigError where no runner can be opened by these flags, before anything is begun."""
    if command.style_service.address:
        if command.runner != "ray":
            raise ConfigError("--style-service.address needs several processes: add --runner ray")
        style_service.require(command.style_service)
        if not (experiment.stages or _styled(experiment)):
            raise ConfigError(
                "--style-service.address: there is no style reward at --ppo.style-weight 0: leave"
                " one of them out"
            )
    if experiment.simulator != "warp":
        divide(experiment.scenes, experiment.block, workers)


@contextmanager
def open_runner(
    command: Train,
    experiment: Experiment,
    run: RunDirectory,
    workers: int,
    note: Callable[[str], None],
    device: torch.device = CPU,
) -> Iterator[Runner]:
    """Open the runner of the flags; it is closed on exit, also after errors.

    note: receives a line for each recovered fault, such as a service that died.
    device: of the learner.
    """
    if command.runner == "ray":
        address, style = command.address, command.style_service
        with ray_runner(experiment, run, workers, address, note, style, device) as runner:
            yield runner
    else:
        with local_runner(experiment, run, workers, device) as runner:
            yield runner


@contextmanager
def local_runner(
    experiment: Experiment,
    run: RunDirectory,
    workers: int,
    device: torch.device = CPU,
    wrap: Callable[[MakeShard], MakeShard] = lambda make: make,
) -> Iterator[Runner]:
    """Open a runner in this process; with several workers each is a process of its own.

    Scenes of mujoco-warp have one worker, in this process: the device steps them all at once.
    wrap: makes another factory of shards of the experiment's.
    """
    made = assembly.make_shard(experiment, run, device)
    make = wrap(made)
    if experiment.simulator == "warp":
        # one inference of all scenes: a device would idle between blocks
        shape = (experiment.scenes, experiment.scenes, 1, experiment.seed, experiment.horizon)
        fleet = LocalFleet(make, *shape, device=made.device)
    else:
        fleet = (LocalFleet if workers == 1 else ProcessFleet)(make, *_shape(experiment, workers))
    try:
        styled = _styled(experiment)
        style = assembly.discriminator(experiment, device=device) if styled else None
        kinds = mixing.kind_names(experiment)
        if isinstance(fleet, ProcessFleet):
            yield Runner(fleet, style, kinds, fleet.ready)
        else:
            yield Runner(fleet, style, kinds)
    finally:
        fleet.close()


@contextmanager
def ray_runner(
    experiment: Experiment,
    run: RunDirectory,
    workers: int,
    address: str | None,
    note: Callable[[str], None],
    style: StyleAddress,
    device: torch.device = CPU,
) -> Iterator[Runner]:
    """Open a runner of Ray actors, with the style service at an address or in a process of its
    own; on a GPU without an address, the discriminator is in the learner's process, and without a
    style reward there is none."""
    from actors.cluster import ray_session  # takes a second, which the local runner does not need
    from actors.fleet import FleetConfig, RayFleet

    with ExitStack() as stack:
        client: Style | None
        if not _styled(experiment):
            client = None
        elif style.address:
            client = stack.enter_context(attached(style, experiment, note, run))
        elif device.type != "cpu":
            client = assembly.discriminator(experiment, device=device)
        else:
            client = stack.enter_context(style_client(experiment, run, note))
        stack.enter_context(ray_session(workers, address))
        # a long rollout is no hung one: 2 s a control step are ten times what a shard takes
        config = FleetConfig(rollout_s=FleetConfig.rollout_s + 2.0 * experiment.horizon)
        make, shape = assembly.make_shard(experiment, run), _shape(experiment, workers)
        fleet = RayFleet(make, *shape, config=config)
        stack.callback(fleet.close)
        yield Runner(fleet, client, mixing.kind_names(experiment))


@contextmanager
def style_client(
    experiment: Experiment, run: RunDirectory, note: Callable[[str], None]
) -> Iterator[StyleClient]:
    """Start a style service of this run on a free port; yield its client."""
    journal = run.path / "style"
    # The journal of an earlier process can be ahead of the checkpoint, or behind it.
    shutil.rmtree(journal, ignore_errors=True)
    # without a token any program on this machine could send samples to this training
    token = secrets.token_hex(32)
    spec = assembly.style_service(experiment, ServerConfig(token=token), str(journal))
    process = start_process(spec, note)
    try:
        channel = ChannelConfig(address=process.address, token=token)
        client = StyleClient(channel, note, lost=lambda: process.lost)
        try:
            yield client
        finally:
            client.close()
    finally:
        process.stop()
        shutil.rmtree(journal, ignore_errors=True)


def _styled(experiment: Experiment) -> bool:
    """Return whether the reward has a style term, and so the training a discriminator."""
    return experiment.ppo.style_weight > 0.0


def _shape(experiment: Experiment, workers: int) -> tuple[int, int, int, int, int]:
    """Return scenes, block, workers, seed and horizon, the arguments of every fleet."""
    return (
        experiment.scenes,
        experiment.block,
        workers,
        experiment.seed,
        experiment.horizon,
    )
