"""The flags of every subcommand; the docstring under a field is its --help."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from console.experiment import Experiment
from policy.config import PolicyServiceConfig

Preset = Literal["fast", "paper"]
Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Unit = Literal["m", "cm", "mm", "in", "ft"]
Protocol = Literal["table1", "table3"]


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
    """Pieces to use: test (never trained on), train, or a file or folder of imported ones."""
    perturb: Literal["none", "projectiles", "moved"] = "none"
    """Disturbances: 20 balls of 1.2 kg thrown at the body, or the furniture moved once, as the
    character comes near."""
    preset: Protocol = "table1"
    """Protocol: table1 (1-10 m), or table3, the comparison with kinematic methods (1-5 m)."""
    near_m: float | None = None
    """Closest start; default: the preset's."""
    far_m: float | None = None
    """Farthest start; default: the preset's."""
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
    tls_client_ca: Path | None = None
    """Clients must show a certificate that one of these (PEM) has signed: mutual TLS."""
    token_file: Path | None = None
    """Clients must send the token in this file."""
    allow_insecure_remote: bool = False
    """Listen beyond this machine without TLS and a token (or client certificates)."""
    metrics: str | None = None
    """HOST:PORT of a Prometheus endpoint."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Serve:
    """The policy service (gRPC) of one or more runs, until Ctrl-C."""

    sources: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """Runs or checkpoint folders; NAME=RUN gives a name, else its task is the name."""
    checkpoint: Literal["best", "latest"] = "best"
    """Of a run: the one to serve, and to take whenever a newer one bears the name."""
    listen: str = "127.0.0.1:50051"
    """HOST:PORT; port 0 takes a free one and prints it."""
    tls_cert: Path | None = None
    """Certificate chain (PEM), with --tls-key."""
    tls_key: Path | None = None
    """Private key (PEM)."""
    tls_client_ca: Path | None = None
    """Clients must show a certificate that one of these (PEM) has signed: mutual TLS."""
    token_file: Path | None = None
    """Clients must send the token in this file."""
    allow_insecure_remote: bool = False
    """Listen beyond this machine without TLS and a token (or client certificates)."""
    metrics: str | None = None
    """HOST:PORT of a Prometheus endpoint."""
    drain_s: float = 10.0
    """Time for calls in progress to end when told to stop."""
    max_message_mb: float = 4.0
    """Largest single message."""
    service: Annotated[PolicyServiceConfig, tyro.conf.arg(name="")] = PolicyServiceConfig()
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Export:
    """A run's policy as ONNX, normaliser baked in, checked against the original."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|CHECKPOINT")]
    """Run directory (its best checkpoint) or checkpoint folder."""
    out: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="FILE.onnx")]
    """The file to write."""
    checkpoint: Literal["best", "latest"] = "best"
    """Of a run: which."""
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
class MotionsImport:
    """Motions of other bodies as clips of the character; 1 if any is refused."""

    paths: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="IN")]
    """Files or folders: BVH, ASF/AMC, DeepMimic .txt, AMASS .npz, SAMP and MimicKit .pkl, poselib
    .npy, and clips (.npz) to be mended."""
    out: Path
    """The folder of clips to write, for --motions."""
    map: Path | None = None
    """JSON that names joints ({"left_knee": "LeftLeg"}), the length unit (unit_m), the upward axis
    (up: y or z) where files do not tell."""
    format: str | None = None
    """Read all files as this format instead of finding out: bvh, acclaim, deepmimic, clip, amass,
    samp, mimickit or poselib."""
    replace: bool = False
    """Write over clips of the same name."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class MotionsCheck:
    """How well clips fit the character: errors, skating, rests; 1 if any is refused."""

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Files or folders, of clips or of motions to import; default: the package's own."""
    map: Path | None = None
    """As of motions import."""
    format: str | None = None
    """As of motions import."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class MotionsPlay:
    """Clips in a browser, with what they use and the skeleton they came from."""

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Files or folders; default: the package's own."""
    only: str | None = None
    """Only clips whose name holds this."""
    html: Path | None = None
    """Write the page here, one file that needs nothing else, instead of serving it."""
    listen: str = "127.0.0.1:0"
    """HOST:PORT to serve it at; port 0 takes a free one and prints it."""
    open: bool = True
    """Open the browser."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class ObjectsList:
    """The pieces of furniture, a line each."""

    objects: tyro.conf.Positional[tuple[str, ...]] = ("all",)
    """train, test, all, or files and folders of imported pieces."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Meshes:
    """How a mesh is to be understood; by default, as its format says."""

    up: Axis | None = None
    """The file's axis that points up; default: +y for glTF, else +z."""
    front: Axis | None = None
    """The file's axis that the user of the piece faces; default: +z where y is up, else +x."""
    unit: Unit | None = None
    """Of the file's coordinates; default: m."""
    height: float | None = None
    """Scale the piece to this height, m, instead of a unit."""
    category: str | None = None
    """chair, armchair, low-stool, high-stool, sofa, bed or table; default: by its folder's or
    file's name, else by its shape."""
    licence: str = "unknown"
    """Under which terms the meshes may be used, where they do not say so themselves."""
    credit: str = ""
    """Who made them, where they do not say so themselves."""
    sit: str | None = None
    """X,Y,Z,YAW (m, degrees; piece frame) of the place to sit, instead of looking for one."""
    threads: int | None = None
    """Pieces at a time; default: the cores there are."""


@dataclass(frozen=True)
class ObjectsImport:
    """Make pieces of meshes (OBJ, glTF, STL, PLY, Sweet Home 3D libraries): hulls and places."""

    paths: tyro.conf.Positional[tuple[Path, ...]]
    """Files or folders."""
    mesh: Annotated[Meshes, tyro.conf.arg(name="")]
    out: Path = Path("objects")
    """Folder for the pieces, a .piece.json each."""
    json: bool = False
    """Print JSON instead, as objects check does."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class ObjectsCheck:
    """What meshes or pieces are as furniture: size, hulls, places; 1 if any is refused."""

    paths: tyro.conf.Positional[tuple[str, ...]]
    """Meshes, imported pieces, folders of either, or train, test, all."""
    mesh: Annotated[Meshes, tyro.conf.arg(name="")]
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class ObjectsShow:
    """Pictures of pieces with their places: a contact sheet, or a page to turn them in."""

    objects: tyro.conf.Positional[tuple[str, ...]] = ("test",)
    """train, test, all, or files and folders of imported pieces."""
    category: str | None = None
    """Only this class."""
    limit: int = 60
    """At most so many pieces; 0: all."""
    sheet: Path | None = None
    """Write the contact sheet here (PNG)."""
    html: Path | None = None
    """Write the page here, one file that needs nothing else."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Bench:
    """Measure one part against its own limit."""

    part: tyro.conf.Positional[Literal["world", "furniture", "learner", "style", "serve", "train"]]
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
    objects: tuple[str, ...] = ("train",)
    """Of bench furniture: train, test, all, or files and folders of imported pieces."""
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
