"""Flags of `inhabit distill`."""

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
    """Scenes of a process."""
    noise: float = 0.03
    """Standard deviation of the action noise in every other scene, in units of the action."""
    seed: int = 0
    """Seed of the scenes; each process adds 1000 times its number."""


@dataclass(frozen=True)
class Dagger:
    """Settings of DAgger: how long, and how the student is regressed on the labels."""

    minutes: float = 10.0
    """Wall time, min."""
    batches: int | None = None
    """Stop after so many batches, where that is before the wall time."""
    workers: int = 1
    """Processes that simulate and label."""
    batch: int = 1024
    """Samples of a batch, half of them from the newest third."""
    rate: float = 1e-3
    """Learning rate of the first batch; it decays to 1e-6 by a cosine."""
    spell: tuple[float, float] = (10.0, 200.0)
    """Mean number of control steps that the student drives at a time, at the start and at the end.
    The teachers then drive for about 20 steps."""
    first: int = 20_000
    """Samples before the first batch; the normaliser is fitted to them."""
    capacity: int = 3_000_000
    """Samples kept, the newest."""
    hidden: tuple[int, ...] = (512, 256)
    """Hidden widths of the networks."""


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
    dagger: Annotated[Dagger, tyro.conf.arg(name="")] = field(default_factory=Dagger)
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
