"""Flags of `inhabit teach`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from world.config import InitialStates, WorldConfig


@dataclass(frozen=True)
class Labelled:
    """The scenes in which states are visited and labelled."""

    steps: int = 40
    """Control steps of all scenes between two transfers of labels."""
    scenes: int = 128
    """Scenes of a process; with a box each has one of its own size."""
    noise: float = 0.03
    """Standard deviation of the action noise in every other scene, in units of the action."""
    seed: int = 0
    """Seed of the scenes; each process adds 1000 times its number."""


@dataclass(frozen=True)
class Practice(Labelled):
    """The scenes of the scripted teacher."""

    in_hand: float = 0.25
    """Fraction of the initial states with the box in hand."""
    near: float = 0.25
    """Fraction of the other initial states within 0.6 to 1.5 m of the box."""
    lifted: float = 0.0
    """Fraction of the initial states in which the scene's box was last lifted."""
    skew: float = 1.0
    """Exponent of the boxes' sizes: uniform at 1, more large boxes below."""
    walker: Path | None = None
    """Checkpoint of a carry policy that labels the approach instead of the scripted teacher, which
    then labels states near the box and stalled ones. Its neck must show the phase cue."""


@dataclass(frozen=True)
class Dagger:
    """Settings of DAgger: how long, and how the student is regressed on the labels."""

    minutes: float = 60.0
    """Wall time, min."""
    batches: int | None = None
    """Stop after so many batches, where that is before the wall time."""
    workers: int = 1
    """Processes that simulate and label."""
    batch: int = 1024
    """Samples of a batch, half of them from the newest third."""
    rate: float = 1e-3
    """Learning rate of the first batch; it decays to 1e-6 by a cosine."""
    spell: tuple[float, float] = (10.0, 100.0)
    """Mean number of control steps that the student drives at a time, at the start and at the end.
    The teacher then drives for about 20 steps."""
    first: int = 100_000
    """Samples before the first batch; the normaliser is fitted to them, and the linear map of a
    policy that has one."""
    capacity: int = 6_000_000
    """Samples kept, the newest."""
    hidden: tuple[int, ...] = (512, 256)
    """Hidden widths of the networks."""


@dataclass(frozen=True)
class TeachCarry:
    """Train a carry policy by DAgger: imitation of the scripted teacher in the student's states."""

    out: tyro.conf.Positional[Path]
    """Checkpoint folder to write, every minute and at the end."""
    practice: Annotated[Practice, tyro.conf.arg(name="")] = field(default_factory=Practice)
    dagger: Annotated[Dagger, tyro.conf.arg(name="")] = field(default_factory=Dagger)
    init: Path | None = None
    """Checkpoint of a carry policy with a linear map to start from; narrower networks are
    widened."""
    replace: bool = False
    """Replace an existing checkpoint folder."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Distill:
    """Distill policies that each know a part of a task into one that does it whole (DAgger): a
    walker the way, a tracker sitting down or picking up as in the clips, an expert of the task the
    rest."""

    task: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="TASK")]
    """Task: sit or carry, with a walker, a tracker or both; lie with a walker."""
    out: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="PATH")]
    """Checkpoint folder to write, every minute and at the end: train --init continues from it."""
    practice: Annotated[Labelled, tyro.conf.arg(name="")] = field(default_factory=Labelled)
    dagger: Annotated[Dagger, tyro.conf.arg(name="")] = field(
        default_factory=lambda: Dagger(
            minutes=10.0, spell=(10.0, 200.0), first=20_000, capacity=3_000_000
        )
    )
    motions: tuple[Path, ...] = ()
    """Motion clips, files or folders, of the initial states and for the tracker; default: the
    package's own clips."""
    init: Path | None = None
    """Run, checkpoint or name of a policy to start from, of this task or of another."""
    replace: bool = False
    """Replace an existing checkpoint folder."""
    world: WorldConfig = field(
        default_factory=lambda: WorldConfig(
            held_out=False,
            initial=InitialStates(0.1, 0.4, 0.5, near_m=(0.5, 1.6), standing_fraction=0.4),
        )
    )
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class TeachTry:
    """Evaluate the scripted teacher of carry in the trials that policies are evaluated in."""

    trials: int = 128
    """Number of trials."""
    near_m: float = 1.0
    """Smallest initial distance of the box, and of its target from it, m."""
    far_m: float = 5.0
    """Largest initial distance of the box, and of its target from it, m."""
    seconds: float = 20.0
    """Length of a trial, s."""
    seed: int = 0
    """Seed of the trials."""
    noise: float = 0.0
    """Standard deviation of the action error, in units of the action; an error lasts about five
    control steps, as those of a student do."""
    threads: int = 1
    """Chunks of trials simulated in parallel."""
    json: bool = False
    """Print JSON instead of text."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class TeachRecord:
    """Record the scripted teacher of carry as motion clips with a box, for --motions."""

    out: tyro.conf.Positional[Path]
    """Folder of clips to write."""
    clips: int = 200
    """Number of clips."""
    scenes: int = 128
    """Scenes simulated at once."""
    seed: int = 0
    """Seed of the boxes and stands."""
    debug: bool = False
    """Show the traceback of an error."""
