"""The flags of the services and of what leaves a run for elsewhere."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from policy.config import PolicyServiceConfig


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
    health: str | None = None
    """HOST:PORT that answers health checks alone, without TLS: for Kubernetes' gRPC probes."""
    drain_s: float = 10.0
    """Time for calls in progress to end when told to stop."""
    max_message_mb: float = 4.0
    """Largest single message."""
    service: Annotated[PolicyServiceConfig, tyro.conf.arg(name="")] = PolicyServiceConfig()
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Style:
    """The discriminator service, standing alone, until Ctrl-C."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """Run whose configuration, motions and checkpoint it serves."""
    state: Path | None = None
    """Folder of a journal from which the service, once killed, goes on."""
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
class Synthesize:
    """A motion of a run's policy in a scene of your own: clip, BVH, 3-D page, film, full states."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|CHECKPOINT")]
    """Run directory or checkpoint folder."""
    out: tuple[Path, ...]
    """FILE.npz (a clip), .bvh, .html (3-D replay), .mp4 or .msgpack (full states); several get the
    same motion."""
    object: str | None = None
    """What it uses: a piece of the catalogue (chair-test-000; inhabit objects list), an imported
    .piece.json, or a mesh; of a policy that carries: box; of one that walks: nothing."""
    start: str = "3,0,180"
    """X,Y,YAW: where the character stands at first, m, and where it faces, degrees."""
    at: str = "0,0,0"
    """X,Y,YAW: where the piece stands, m, and where its front faces, degrees; of a policy that
    walks, where to, and which way to face there."""
    place: int = 0
    """Which place of use, where a piece has several: a bed is got onto by either side."""
    scale: float = 1.0
    """Of the piece or box."""
    to: str | None = None
    """X,Y,HEIGHT: the stand that the box should go to, m; carry only."""
    stand_m: float = 0.6
    """Height of the stand that the box is on at first, m; carry only."""
    box_kg: float | None = None
    """Weight of the box; default: by its volume."""
    seconds: float = 20.0
    """Longest; it ends sooner with a fall, or when success was held for a while."""
    seed: int | None = None
    """Draw the actions with this seed instead of taking their means; perturbations too."""
    tries: int = 1
    """Try further seeds until a motion succeeds without a fall; else the last is written."""
    perturb: Literal["none", "projectiles", "moved"] = "none"
    """Balls thrown at the character, or its furniture moved away when it comes near."""
    to_the_end: bool = False
    """Go on after a fall or a success, for all of --seconds."""
    checkpoint: Literal["best", "latest"] = "best"
    """Of a run: which."""
    overwrite: bool = False
    """Replace files that exist."""
    debug: bool = False
    """Show the traceback of an error."""
