"""The flags of training and of what follows a run."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from console.run.experiment import Experiment

Preset = Literal["fast", "paper", "track"]
Protocol = Literal["table1", "table3"]


@dataclass(frozen=True)
class StyleAddress:
    """A style service that stands alone (inhabit style RUN), and what it is shown."""

    address: str = ""
    """HOST:PORT of the service to use; default: one of this run's own. Needs --runner ray."""
    tls_ca: Path | None = None
    """Certificates (PEM) that may have signed the service's; gives TLS."""
    tls_cert: Path | None = None
    """Our certificate (PEM), where the service asks for one: mutual TLS."""
    tls_key: Path | None = None
    """Its private key (PEM)."""
    token_file: Path | None = None
    """File with the token that the service asks for."""


@dataclass(frozen=True)
class Train:
    """Train a task; Ctrl-C writes a checkpoint, --resume goes on from it."""

    task: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="TASK")]
    """What to learn: sit."""
    experiment: Annotated[Experiment, tyro.conf.arg(name="")]
    run: Path | None = None
    """Run directory; default runs/TASK-<date>-<n>. An existing one needs --resume or --restart."""
    preset: Preset = "fast"
    """Defaults of everything below: fast (512 x 256 networks), paper (1024 x 512), or track
    (motion tracking, the default of the task track)."""
    motions: tuple[Path, ...] = ()
    """Motion clips, files or folders; default: the package's own."""
    objects: tuple[str, ...] = ()
    """Files or folders of imported pieces, and train for the package's own furniture; default:
    train."""
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
    """Ray cluster to join; default: that of the submitted job, else a private one."""
    style_service: StyleAddress = StyleAddress()
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
    """Pieces to use: test (never trained on), train, or a file or folder of imported ones."""
    perturb: Literal["none", "projectiles", "moved"] = "none"
    """Disturbances: 20 balls of 1.2 kg thrown at the body, or the furniture moved once, as the
    character comes near."""
    preset: Protocol = "table1"
    """Protocol: table1 (1-10 m), or table3, the comparison with kinematic methods (1-5 m)."""
    near_m: float | None = None
    """Closest start, and target of a box from where it stands; default: the preset's."""
    far_m: float | None = None
    """Farthest start, and target of a box; default: the preset's."""
    quality: int = 64
    """Trials that motion quality is measured on, beside the mocap's; 0: none."""
    motions: tuple[Path, ...] = ()
    """Clips that it is compared with; default: those that the policy was trained on."""
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
class Report:
    """A run as one HTML file: results, replay, pictures, motion quality, curves."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|CHECKPOINT")]
    """Run directory (its latest checkpoint) or checkpoint folder."""
    out: Path | None = None
    """The file; default: report.html in the run, or NAME-report.html for a checkpoint folder."""
    trials: int = 96
    """Trials recorded for the replay and for motion quality; success is of the run's largest
    evaluation of this checkpoint, where there is one."""
    objects: str = "test"
    """Pieces to use: test (never trained on) or train."""
    perturb: Literal["none", "projectiles", "moved"] = "none"
    """Disturbances of these trials, as of evaluate."""
    motions: tuple[Path, ...] = ()
    """Clips that motion quality is compared with; default: those that the policy was trained on."""
    seed: int = 0
    """Of the trials."""
    threads: int | None = None
    """Default: the cores there are."""
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
    average: int = 1
    """Publish the mean of so many of the run's last checkpoints instead of the last one."""
    evaluation: tuple[Path, ...] = ()
    """The JSON of evaluations of these weights, one of each perturbation."""
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
    """Closest start, and target of a box from where it stands."""
    far_m: float = 5.0
    """Farthest start, and target of a box."""
    seed: int = 0
    """Of the trials."""
    width: int = 640
    """Pixels across."""
    height: int = 480
    """Pixels down."""
    debug: bool = False
    """Show the traceback of an error."""
