"""The flags of every subcommand; the docstring under a field is its --help."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from console.experiment import Experiment

Preset = Literal["fast", "paper"]


@dataclass(frozen=True)
class Train:
    """Train a task; Ctrl-C writes a checkpoint, --resume goes on from it."""

    task: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="TASK")]
    """What to learn: sit."""
    experiment: Annotated[Experiment, tyro.conf.arg(name="")]
    run: Path | None = None
    """Run directory; default runs/TASK-<date>-<n>. An existing one needs --resume or --restart."""
    preset: Preset = "fast"
    """Defaults of everything below: fast (512 x 256 networks) or paper (1024 x 512)."""
    motions: tuple[Path, ...] = ()
    """Motion clips, files or folders; default: the package's own."""
    samples: int | None = None
    """Stop after so many control steps over all scenes."""
    iterations: int | None = None
    """Stop after so many PPO iterations."""
    minutes: float | None = None
    """Stop after so much wall time of this session."""
    runner: Literal["local", "ray"] = "local"
    """local: one process. ray: actors, learner and the style service in processes of their own."""
    threads: int | None = None
    """Threads of the local runner; default: the cores there are."""
    actors: int | None = None
    """Rollout workers; default: as many as threads (local) or cores (ray)."""
    address: str | None = None
    """Ray cluster to join; default: one on this machine, for this run alone."""
    init: Path | None = None
    """Run or checkpoint whose networks and normalisers to start from."""
    dry_run: bool = False
    """Show the resolved configuration, features and rewards, and stop."""
    resume: bool = False
    """Go on from the run's latest checkpoint, exactly."""
    restart: bool = False
    """Erase the run and begin again."""
    checkpoint_every: int = 100
    """Iterations between checkpoints."""
    keep: int = 3
    """Checkpoints kept besides the best."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Evaluate:
    """Success within 20 s, by the paper's protocol, with intervals."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|CHECKPOINT")]
    """Run directory (its latest checkpoint) or checkpoint folder."""
    trials: int = 4096
    """How many trials; the paper's number is the default."""
    objects: str = "test"
    """Pieces to sit on: test (never trained on) or train."""
    perturb: Literal["none"] = "none"
    """Disturbances during a trial."""
    near_m: float = 1.0
    """Closest start."""
    far_m: float = 10.0
    """Farthest start."""
    seed: int = 0
    """Of the trials: the same seed is the same trials, whatever the number of threads."""
    threads: int | None = None
    """Default: the cores there are."""
    json: Path | None = None
    """Write the figures here; always also into the run's evaluations/."""
    record: Path | None = None
    """Write the first trials as a .msgpack recording."""
    record_trials: int = 8
    """How many trials --record keeps."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Publish:
    """A run's policy as a small folder, with its data, licence and evaluation."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|CHECKPOINT")]
    """Run directory (its latest checkpoint) or checkpoint folder."""
    out: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="DIR")]
    """The folder to write."""
    data: str
    """What the weights were trained on."""
    licence: str
    """Under which terms the weights may be used."""
    evaluation: Path | None = None
    """The JSON of an evaluation of these weights."""
    replace: bool = False
    """Replace the folder where it exists."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Video:
    """An mp4 of a run's policy, or of a recording."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|FILE")]
    """Run directory, checkpoint folder, or .msgpack recording."""
    out: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="OUT.mp4")] = None
    """The film; may be left out with --sheet."""
    sheet: Path | None = None
    """Write a filmstrip too (PNG; a row a trial)."""
    trials: int = 4
    """Trials shown, one after the other."""
    seconds: float = 12.0
    """Length of each."""
    objects: str = "test"
    """Pieces: test or train."""
    near_m: float = 1.5
    """Closest start."""
    far_m: float = 5.0
    """Farthest start."""
    seed: int = 0
    """Of the trials."""
    width: int = 640
    """Pixels across."""
    height: int = 480
    """Pixels down."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Style:
    """The discriminator service, standing alone, until Ctrl-C."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """Run whose configuration, motions and checkpoint it serves."""
    listen: str = "127.0.0.1:50061"
    """HOST:PORT; port 0 takes a free one and prints it."""
    tls_cert: Path | None = None
    """Certificate chain (PEM), with --tls-key."""
    tls_key: Path | None = None
    """Private key (PEM)."""
    token_file: Path | None = None
    """Clients must send the token in this file."""
    metrics: str | None = None
    """HOST:PORT of a Prometheus endpoint."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class MotionsList:
    """The clips found, a line each."""

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Files or folders; default: the package's own."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class MotionsCheck:
    """How well clips fit the character: errors, skating, rests; 1 if any is refused."""

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Files or folders; default: the package's own."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class ObjectsList:
    """The pieces of furniture, a line each."""

    objects: Literal["train", "test", "all"] = "all"
    """Which of them."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Bench:
    """Measure one part against its own limit."""

    part: tyro.conf.Positional[Literal["world", "learner", "style", "train"]]
    """Which part."""
    preset: Preset = "fast"
    """Network sizes and batch."""
    scenes: int | None = None
    """Default: the preset's."""
    threads: int | None = None
    """Default: the cores there are."""
    seconds: float = 10.0
    """Roughly how long to measure each figure."""
    runner: Literal["local", "ray"] = "local"
    """Of bench train."""
    motions: tuple[Path, ...] = ()
    """Clips; default: the package's own."""
    json: Path | None = None
    """Write the figures here."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Doctor:
    """What this machine has of what training needs."""

    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""
