"""Flags of the services, of export and of synthesis."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from console.commands.animation import AnimationFlags
from policy.config import PolicyServiceConfig


@dataclass(frozen=True)
class Serve:
    """Serve the policies of one or more runs by gRPC until Ctrl-C."""

    sources: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """Runs, checkpoint folders, or names of policies that the package brings (sit, sit-free, lie,
    lie-free, carry, walk); NAME=RUN sets the name under which one is served, else the task is the
    name."""
    checkpoint: Literal["best", "latest"] = "best"
    """Checkpoint of a run; a newer one of this name is loaded while serving."""
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
    health: str | None = None
    """HOST:PORT that answers health checks alone, without TLS: for Kubernetes' gRPC probes."""
    drain_s: float = 10.0
    """Time for calls in progress to end after a stop signal, s."""
    max_message_mb: float = 4.0
    """Largest message, MiB."""
    service: Annotated[PolicyServiceConfig, tyro.conf.arg(name="")] = PolicyServiceConfig()
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Style:
    """Serve the discriminator of a run as a standalone service until Ctrl-C."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """Run whose configuration, motions and checkpoint are served."""
    state: Path | None = None
    """Folder of a journal from which the service resumes after a crash."""
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
    health: str | None = None
    """HOST:PORT that answers health checks alone, without TLS: for Kubernetes' gRPC probes."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Export:
    """Export a policy as ONNX, with its normaliser, and compare it with the original; or export a
    recording or motion clip for animation programs: glTF, BVH, SMPL parameters."""

    source: Annotated[
        Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|CHECKPOINT|NAME|MOTION")
    ]
    """Run directory (its best checkpoint), checkpoint folder, or name of a policy that the package
    brings (sit, sit-free, lie, lie-free, carry, walk), for .onnx; else a recording (.msgpack) or
    motion clip (.npz)."""
    out: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="FILE")]
    """FILE.onnx of a policy; FILE.glb, .gltf, .bvh or .smpl.npz of a motion."""
    checkpoint: Literal["best", "latest"] = "best"
    """Checkpoint of a run."""
    take: int | None = None
    """Index of the take of a recording, from 0; default: the only one."""
    files: Annotated[AnimationFlags, tyro.conf.arg(name="")] = AnimationFlags()
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Synthesize:
    """Simulate a policy in a given scene and write the motion: clip, glTF, BVH, SMPL parameters,
    3-D page, video, full states."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|CHECKPOINT|NAME")]
    """Run directory, checkpoint folder, or name of a policy that the package brings: sit, sit-free,
    lie, lie-free, carry, walk."""
    out: tuple[Path, ...]
    """FILE.npz (a clip), .glb or .gltf (skinned character and objects), .bvh, .smpl.npz (SMPL
    parameters), .html (3-D replay), .mp4 or .msgpack (full states); several files get the same
    motion."""
    object: str | None = None
    """Object of the scene: a piece of the catalogue (chair-test-000; inhabit objects list), an
    imported .piece.json, or a mesh; box for carry; none for walk."""
    start: str = "3,0,180"
    """X,Y,YAW of the character's initial stand pose, m and degrees."""
    at: str = "0,0,0"
    """X,Y,YAW of the piece and its front, m and degrees; for walk, of the target."""
    place: int = 0
    """Index of the use point of a piece with several, such as the sides of a bed."""
    scale: float = 1.0
    """Scale of the piece or box."""
    to: str | None = None
    """X,Y,HEIGHT of the target stand of the box, m; carry only."""
    stand_m: float = 0.6
    """Height of the stand that the box is on initially, m; carry only."""
    box_kg: float | None = None
    """Mass of the box, kg; default: by its volume."""
    seconds: float = 20.0
    """Longest simulated time, s; a fall or a held success ends the motion earlier."""
    seed: int | None = None
    """Seed of the action noise and of the perturbations; default: mean actions."""
    tries: int = 1
    """Number of tries, with consecutive seeds, until a motion succeeds without a fall; without
    success the last one is written."""
    perturb: Literal["none", "projectiles", "moved"] = "none"
    """Disturbance: balls thrown at the character, or furniture moved as the character
    approaches."""
    to_the_end: bool = False
    """Continue after a fall or a success until --seconds."""
    checkpoint: Literal["best", "latest"] = "best"
    """Checkpoint of a run."""
    overwrite: bool = False
    """Overwrite existing files."""
    files: Annotated[AnimationFlags, tyro.conf.arg(name="")] = AnimationFlags()
    debug: bool = False
    """Show the traceback of an error."""
