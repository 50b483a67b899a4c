"""`inhabit style`: the discriminator service of a run, standing alone."""

from collections.abc import Mapping
from pathlib import Path

import torch
from torch import Tensor

from console.commands import Serve, Style
from console.run import assembly
from console.run.directory import RunDirectory, RunError, checkpoint_folder
from console.run.experiment import read_experiment
from discriminator.journal import Journal
from discriminator.process import build
from discriminator.service import start
from discriminator.trainer import Discriminator
from policy.checkpoints.format import State, read
from rpc.server import ServerConfig


def style_command(command: Style) -> int:
    """Serve until SIGTERM or Ctrl-C, then drain; returns the exit code."""
    torch.set_num_threads(1)
    run = RunDirectory(command.source)
    server = listening(command)
    state = _text(command.state)
    style, journal = build(assembly.style_service(read_experiment(run), server, state))
    try:
        checkpoint = checkpoint_folder(run.path)
    except RunError:
        checkpoint = None  # a run that has just begun: the service begins with it
    begun = "the beginning"
    kept = journal.load() if journal is not None else None
    if kept is not None:
        begun = "its journal"
    if checkpoint is not None:
        saved = read(checkpoint, ("style",)).state["style"]
        if kept is None or version_of(kept) < version_of(saved):
            begun = f"checkpoint {checkpoint.name}"
            begin_from(style, saved, journal)
    service = start(style, server, journal=journal)
    print(
        f"style service of {run.path} at {service.address}, from {begun}, version {style.version}",
        flush=True,
    )
    service.run()
    return 0


def version_of(state: Mapping[str, Tensor]) -> int:
    """Trainings that a saved state has behind it."""
    version = state.get("counters/version")
    return -1 if version is None or version.numel() != 1 else int(version)


def begin_from(style: Discriminator, saved: State, journal: Journal | None) -> None:
    """Begin with a checkpoint's state, and the journal with it.

    The replay is the journal's file: another state in it belongs to another replay.
    """
    style.check_state(saved)
    if journal is not None:
        journal.clear()
    style.load_state_dict(saved)
    if journal is not None:
        journal.save(style.state_dict(replay=False))


def listening(command: Style | Serve) -> ServerConfig:
    """Where a service listens, and to whom, as the flags have it."""
    return ServerConfig(
        listen=command.listen,
        tls_cert=_text(command.tls_cert),
        tls_key=_text(command.tls_key),
        tls_client_ca=_text(command.tls_client_ca),
        token_file=_text(command.token_file),
        allow_insecure_remote=command.allow_insecure_remote,
        metrics=command.metrics or "",
        health=command.health or "",
    )


def _text(path: Path | None) -> str:
    return "" if path is None else str(path)
