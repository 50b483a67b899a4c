"""The flags of what looks at this machine."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from console.commands.training import Preset


@dataclass(frozen=True)
class Bench:
    """Measure one part against its own limit."""

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
        ]
    ]
    """Which part."""
    preset: Preset = "fast"
    """Network sizes and batch."""
    scenes: int | None = None
    """Default: the preset's. Of bench scaling: of each actor, by default half of that."""
    threads: int | None = None
    """Default: the cores there are."""
    seconds: float = 10.0
    """Roughly how long to measure each figure."""
    runner: Literal["local", "ray"] = "local"
    """Of bench train and bench endurance."""
    device: Literal["auto", "cpu", "cuda"] = "auto"
    """Of what learns, and of warp's scenes, in bench world, train and learner; auto: a GPU where
    there is one."""
    simulator: Literal["mujoco", "warp"] = "mujoco"
    """Of bench world and bench train; warp: mujoco-warp on the device, beside its raw stepping."""
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
    """What this machine, its cluster and its services have of what training needs."""

    address: str | None = None
    """Ray cluster to look at; default: that of the environment (RAY_ADDRESS), if any."""
    style: str | None = None
    """HOST:PORT of a style service to ask for its health."""
    policy: str | None = None
    """HOST:PORT of a policy service to ask for its health."""
    tls_ca: Path | None = None
    """Certificates (PEM) to trust when asking; gives TLS."""
    tls_cert: Path | None = None
    """Our certificate (PEM), where the services ask for one."""
    tls_key: Path | None = None
    """Its private key (PEM)."""
    motions: tuple[Path, ...] = ()
    """Clips to read; default: the package's own."""
    seconds: float = 5.0
    """How long to measure samples/s; 0: not at all."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""
