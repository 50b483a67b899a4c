"""`inhabit style`: the discriminator service of a run, standing alone."""

from pathlib import Path

import torch

from console.commands import Serve, Style
from console.run import assembly
from console.run.directory import RunDirectory, RunError, checkpoint_folder
from console.run.experiment import read_experiment
from discriminator.process import build
from discriminator.service import start
from policy.checkpoints.format import read
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
    if checkpoint is not None:
        style.load_state_dict(read(checkpoint, ("style",)).state["style"])
    service = start(style, server, journal=journal)
    print(f"style service of {run.path} at {service.address}, version {style.version}", flush=True)
    service.run()
    return 0


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
