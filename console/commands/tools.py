"""Flags of `inhabit bench`, `plan`, `doctor` and `completion`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from console.commands.training import Preset


@dataclass(frozen=True)
class Bench:
    """Measure one part of the system against its own limit."""

    part: tyro.conf.Positional[
        Literal[
            "world",
            "servos",
            "furniture",
            "box",
            "learner",
            "style",
            "serve",
            "train",
            "endurance",
            "scaling",
            "fuzz",
            "peers",
            "learning",
            "profile",
            "films",
        ]
    ]
    """Part to measure."""
    preset: Preset = "fast"
    """Preset of network sizes and batch."""
    scenes: int | None = None
    """Number of scenes; default: the preset's. For scaling: scenes of each actor; default: half
    the preset's."""
    threads: int | None = None
    """Number of threads; default: the number of cores."""
    seconds: float = 10.0
    """Approximate time of each measurement, s."""
    runner: Literal["local", "ray"] = "local"
    """Runner of bench train and bench endurance."""
    device: Literal["auto", "cpu", "cuda"] = "auto"
    """Device of the networks, and of warp's scenes, in bench world, train and learner; auto: a GPU
    if available."""
    simulator: Literal["mujoco", "warp"] = "mujoco"
    """Simulator of bench world and bench train; warp: mujoco-warp on the device, compared with its
    raw stepping."""
    objects: tuple[str, ...] = ("train",)
    """Pieces of bench furniture: train, test, all, or files and folders of imported pieces."""
    mutations: int = 100_000
    """Number of damaged files of bench fuzz, over all formats."""
    rounds: int = 6
    """Rounds of bench peers; in each, every library takes a turn of --seconds."""
    peer_python: tuple[str, ...] = ()
    """Interpreters of bench peers and bench learning, NAME=PATH each (rsl_rl, skrl, torchrl, rllib,
    unilab); default: the present one."""
    fleet_actors: tuple[int, ...] = (1, 2, 4)
    """Numbers of Ray actors with which bench peers compares ours and RLlib's."""
    samples: int = 10_000_000
    """Samples of each training of bench learning; returns are compared at a fifth, half and all of
    them."""
    seeds: int = 3
    """Number of trainings of each library in bench learning, with the seeds 0, 1, 2 and so on."""
    only: tuple[str, ...] = ()
    """Libraries of bench learning (inhabit, rsl_rl, skrl, torchrl, rllib, inhabit_equal); default:
    all."""
    policy: Path = Path("sit")
    """Policy of bench profile and bench films, a name, a run or a checkpoint: its own training, or
    films of its trials, are measured."""
    motions: tuple[Path, ...] = ()
    """Motion clips, files or folders; default: the package's own clips."""
    json: Path | None = None
    """JSON file of the figures. Bench learning goes on with the trainings that it lacks."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Plan:
    """Estimate rates, memory, traffic and cost of a training on a cluster, and what limits it."""

    actors: int = 2
    """Number of rollout workers, each with a core of its own."""
    scenes: int | None = None
    """Number of scenes over all actors; default: half the preset's for each actor."""
    network: tuple[int, ...] = ()
    """Hidden widths of actor and critic; default: the preset's."""
    task: str = "sit"
    """Task: sit, lie, carry, walk or track."""
    preset: Preset = "fast"
    """Preset of batch and network sizes."""
    horizon: int | None = None
    """Control steps of a scene in an iteration; default: the preset's."""
    overlap: bool = False
    """Actors act while the learner updates (train --lag.overlap)."""
    learner_cores: int = 2
    """Number of cores of the learner; it uses at most 2."""
    gbit_per_s: float = 10.0
    """Bandwidth of the learner's node, Gbit/s."""
    samples: int = 100_000_000
    """Number of samples of the training."""
    price: float = 0.0
    """Price of a core for an hour, in any currency; 0: no cost is stated."""
    measure: bool = False
    """Measure the costs of a sample on this machine; default: the figures of the documentation."""
    seconds: float = 15.0
    """Time of that measurement, s."""
    json: Path | None = None
    """JSON file of the estimate."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Doctor:
    """Check this machine, a Ray cluster and services for what training needs."""

    address: str | None = None
    """Address of the Ray cluster to check; default: RAY_ADDRESS, if set."""
    style: str | None = None
    """HOST:PORT of a style service to check."""
    policy: str | None = None
    """HOST:PORT of a policy service to check."""
    tls_ca: Path | None = None
    """Trusted certificates (PEM) for these services; enables TLS."""
    tls_cert: Path | None = None
    """Client certificate (PEM), for services with mutual TLS."""
    tls_key: Path | None = None
    """Private key (PEM) of the client certificate."""
    token_file: Path | None = None
    """File with the token of the services, whose permissions are checked."""
    motions: tuple[Path, ...] = ()
    """Motion clips to check; default: the package's own clips."""
    seconds: float = 5.0
    """Time of the measurement of samples/s, s; 0: no measurement."""
    json: bool = False
    """Print JSON instead of text."""
    debug: bool = False
    """Show the traceback of an error."""


Shell = Literal["bash", "zsh", "fish"]


@dataclass(frozen=True)
class Completion:
    """Print a script that completes commands, flags and values at the Tab key."""

    shell: tyro.conf.Positional[Shell]
    """Shell of the script. Write it to a file, which the shell reads as it starts."""
    debug: bool = False
    """Show the traceback of an error."""
