"""Flags of training, evaluation, reports, publication and video."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from console.run.experiment import Experiment

Preset = Literal["fast", "paper", "track", "finetune"]
Protocol = Literal["table1", "table3", "weights"]


@dataclass(frozen=True)
class StyleAddress:
    """Address and credentials of a standalone style service (inhabit style RUN)."""

    address: str = ""
    """HOST:PORT of the service; default: a service of this run's own. Needs --runner ray."""
    tls_ca: Path | None = None
    """Trusted certificates (PEM) for the service; enables TLS."""
    tls_cert: Path | None = None
    """Client certificate (PEM), for a service with mutual TLS."""
    tls_key: Path | None = None
    """Private key (PEM) of the client certificate."""
    token_file: Path | None = None
    """File with the token of the service."""


@dataclass(frozen=True)
class Train:
    """Train a policy for a task; Ctrl-C writes a checkpoint, --resume continues from it."""

    task: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="TASK")]
    """Task: sit, lie, carry, walk or track."""
    experiment: Annotated[Experiment, tyro.conf.arg(name="")]
    run: Path | None = None
    """Run directory; default: runs/TASK-<date>-<n>. An existing one needs --resume or --restart."""
    preset: Preset = "fast"
    """Preset of the settings. fast has networks of 512 x 256, paper of 1024 x 512; track is for
    motion tracking, and the default of that task; finetune goes on from a policy that can already
    do the task (--init). A recipe has its own."""
    recipe: str = ""
    """Recipe to train by, in stages: a NAME of the package (paper; for lie also free, for carry
    also weights) or a .toml file. A stage lasts until its condition is measured. Flags of settings
    hold in all stages. See --dry-run."""
    overrides: Annotated[tuple[str, ...], tyro.conf.Fixed, tyro.conf.Suppress] = ()
    """Lines on settings of the recipe that the flags override."""
    motions: tuple[Path, ...] = ()
    """Motion clips, files or folders; default: the package's own clips."""
    objects: tuple[str, ...] = ()
    """Files or folders of pieces; train: the package's own furniture, the default."""
    samples: int | None = None
    """Samples after which training stops. A sample is a control step of one scene."""
    iterations: int | None = None
    """PPO iterations after which training stops."""
    minutes: float | None = None
    """Wall time after which training stops, min. A resumed run counts from 0."""
    runner: Literal["local", "ray"] = "local"
    """Workers: processes of this machine (local), or Ray actors. With ray the style service has a
    process of its own."""
    threads: int | None = None
    """Threads of the local runner; default: the number of cores."""
    actors: int | None = None
    """Number of rollout workers; default: the number of threads (local) or cores (ray)."""
    address: str | None = None
    """Address of the Ray cluster. Default: the cluster of the submitted job, else a private one."""
    style_service: StyleAddress = StyleAddress()
    init: Path | None = None
    """Run or checkpoint that initialises networks and normalisers."""
    dry_run: bool = False
    """Print the resolved configuration, features and rewards, and stop."""
    resume: bool = False
    """Continue from the run's latest checkpoint, exactly."""
    restart: bool = False
    """Erase the run and train from the start."""
    checkpoint_every: int = 100
    """Iterations between checkpoints."""
    keep: int = 3
    """Number of checkpoints kept besides the best."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Evaluate:
    """Evaluate a policy: success within 20 s by the paper's protocol, with intervals."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|CHECKPOINT|NAME")]
    """Run directory (its latest checkpoint), checkpoint folder, or name of a policy of the
    package: sit, sit-free, lie, lie-free, carry, walk, track, track-sit."""
    task: str = ""
    """Of a policy that was trained for several tasks (train --mix): the task to evaluate; default:
    the first."""
    trials: int = 4096
    """Number of trials; the default is the paper's."""
    objects: str = "test"
    """Pieces: test (held out of training), train, or a file or folder of imported pieces."""
    held_out: bool = False
    """Of the pieces of a file or folder, only those that are held out of training: see
    world.held-out."""
    perturb: Literal["none", "projectiles", "moved"] = "none"
    """Disturbance: 20 balls of 1.2 kg thrown at the body, or furniture moved once as the character
    approaches."""
    preset: Protocol = "table1"
    """Protocol: table1 (1-10 m), table3, the comparison with kinematic methods (1-5 m), or weights,
    for carry: table1 with boxes of one size and 1-12 kg."""
    near_m: float | None = None
    """Smallest initial distance of the target, and of a box's target from the box, m; default: the
    protocol's."""
    far_m: float | None = None
    """Largest of these distances, m; default: the protocol's."""
    quality: int = 64
    """Number of trials whose motion quality is measured and compared with mocap; 0: none."""
    simulator: Literal["mujoco", "warp"] = "mujoco"
    """Simulator of the trials; warp: mujoco-warp, on the CPU."""
    motions: tuple[Path, ...] = ()
    """Clips to compare motion quality with; default: the policy's training clips."""
    seed: int = 0
    """Seed of the trials, which do not depend on the number of threads."""
    threads: int | None = None
    """Number of threads; default: the number of cores."""
    json: Path | None = None
    """JSON file of the figures, besides the run's evaluations/."""
    record: Path | None = None
    """Recording (.msgpack) of the first trials."""
    record_trials: int = 8
    """Number of trials in --record."""
    worst: int = 0
    """Number of worst trials whose replays go to the page of --out; 0: none."""
    out: Path | None = None
    """Page (.html) of the worst trials: what fails, as replays."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Realism:
    """Measure how a motion compares with mocap: each measure relative to held-out mocap, by
    phase."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|NAME|RECORDING|CLIPS")]
    """Run directory, checkpoint folder or name of a policy that the package brings (trials are
    simulated), .msgpack recording, or clips: a file or folder."""
    against: tuple[Path, ...] = ()
    """Mocap clips, files or folders; default: the policy's training clips, or the package's own."""
    task: str = "sit"
    """Task of clips, whose object is looked for in them: sit, lie, carry, walk, or track."""
    trials: int = 128
    """Number of trials of a policy, by the default protocol; failures count as well."""
    group: Literal["recording", "folder"] = "recording"
    """What is held out as a whole: each recording, or each folder, as where it is a subject."""
    folds: int = 3
    """Number of times that half of the mocap is held out."""
    noise_rad: float = 0.0
    """Standard deviation of noise that is added to the joint rotations before they are measured,
    rad: a control, for which the ratios must be far from 1."""
    seed: int = 0
    """Seed of the trials, the halves and the classifier."""
    threads: int | None = None
    """Number of threads; default: the number of cores."""
    json: Path | None = None
    """JSON file of the figures."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Report:
    """Write the report of a run as one HTML file: results, replay, pictures, motion quality,
    curves."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|CHECKPOINT|NAME")]
    """Run directory (its latest checkpoint), checkpoint folder, or name of a policy of the
    package: sit, sit-free, lie, lie-free, carry, walk, track, track-sit."""
    out: Path | None = None
    """File to write; default: report.html in the run, or NAME-report.html for a checkpoint
    folder."""
    trials: int = 96
    """Number of trials recorded for replay and motion quality; the success rate is that of the
    run's largest evaluation of this checkpoint, if there is one. A policy that follows clips is
    evaluated by these trials, the first 64 of which are recorded."""
    objects: str = "test"
    """Pieces: test (held out of training) or train."""
    perturb: Literal["none", "projectiles", "moved"] = "none"
    """Disturbance of these trials, as in evaluate."""
    motions: tuple[Path, ...] = ()
    """Clips to compare motion quality with, or to follow; default: the policy's training clips."""
    seed: int = 0
    """Seed of the trials."""
    threads: int | None = None
    """Number of threads; default: the number of cores."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Publish:
    """Publish a run's policy as a small folder, with training data, licence and evaluation."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|CHECKPOINT|NAME")]
    """Run directory (its latest checkpoint), checkpoint folder, or name of a policy of the
    package: sit, sit-free, lie, lie-free, carry, walk, track, track-sit."""
    out: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="DIR")]
    """Folder to write."""
    task: str = ""
    """Of a policy that was trained for several tasks (train --mix): the task that the published
    policy is for; default: the first."""
    data: str = ""
    """Training data of the weights, beside the clips, pieces and ancestors that the checkpoint
    itself names."""
    licence: str = ""
    """Licence of the weights; default: the terms of all that they were trained on."""
    relicense: bool = False
    """Accept a --licence that restricts less than the terms of the training data."""
    average: int = 1
    """Number of the run's last checkpoints whose weights are averaged."""
    evaluation: tuple[Path, ...] = ()
    """JSON files of evaluations of these weights, one for each perturbation; default: the largest
    that the run keeps of this checkpoint, by the default protocol."""
    replace: bool = False
    """Replace an existing folder."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Video:
    """Render a policy or a recording as a film (.mp4) or an animated picture (.webp, .gif)."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|NAME|FILE")]
    """Run directory, checkpoint folder, name of a policy that the package brings (sit, sit-free,
    lie, lie-free, carry, walk, track, track-sit), or .msgpack recording."""
    out: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="OUT.mp4")] = None
    """Film or animated picture to write; optional with --sheet."""
    sheet: Path | None = None
    """Filmstrip to write (PNG; one row per trial)."""
    trials: int = 4
    """Number of trials, shown one after the other; of a recording, the first. The flags seconds,
    objects, near-m, far-m and seed are of trials that are simulated: not of a recording, nor of a
    policy that follows clips."""
    seconds: float | None = None
    """Longest duration of a trial, s; default: the task's time limit. A trial ends 2 s after its
    success."""
    objects: str = "test"
    """Pieces: test or train."""
    near_m: float = 1.5
    """Smallest initial distance of the target, and of a box's target from the box, m."""
    far_m: float = 5.0
    """Largest of these distances, m."""
    seed: int = 0
    """Seed of the trials."""
    threads: int | None = None
    """Number of threads of the trials, and of processes that draw a film; default: the number of
    cores. Neither changes the film."""
    width: int = 640
    """Width of the video, pixels."""
    height: int = 480
    """Height of the video, pixels."""
    look: Literal["body", "shapes"] = "body"
    """Character: a rounded body, or the collision shapes of the simulation."""
    captions: bool = True
    """Write task, piece, time and stage on the images."""
    debug: bool = False
    """Show the traceback of an error."""
