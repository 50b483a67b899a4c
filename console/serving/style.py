"""`inhabit style`: the standalone discriminator service of a run."""

import sys
from collections.abc import Mapping
from pathlib import Path

import torch
from torch import Tensor

from console.commands import Serve, Style
from console.listening import flags_named
from console.run import assembly
from console.run.directory import RunDirectory, RunError, checkpoint_folder
from console.run.experiment import read_experiment
from console.run.recipe import staged
from console.terminal import INTERRUPTED
from discriminator.journal import Journal
from discriminator.process import build
from discriminator.service import start
from discriminator.trainer import Discriminator
from policy.checkpoints.format import State, read
from rpc.address import split_address
from rpc.credentials import read_token, server_credentials
from rpc.errors import RpcError
from rpc.server import ServerConfig, check
from world.errors import ConfigError


def style_command(command: Style) -> int:
    """Serve until SIGTERM or Ctrl-C, then drain; return the exit code, 0 after SIGTERM."""
    torch.set_num_threads(1)
    run = RunDirectory(command.source)
    server = listening(command)
    state = _text(command.state)
    style, journal = build(assembly.style_service(staged(read_experiment(run), 1), server, state))
    try:
        checkpoint = checkpoint_folder(run.path)
    except RunError:
        checkpoint = None  # a new run: the discriminator has its initial state
    origin = "its initial state"
    kept = journal.load() if journal is not None else None
    if kept is not None:
        origin = "its journal"
    if checkpoint is not None:
        saved = read(checkpoint, ("style",)).state["style"]
        # a stage without a style reward, before any with one, has none to restore
        if saved and (kept is None or version_of(kept) < version_of(saved)):
            origin = f"checkpoint {checkpoint.name}"
            restore(style, saved, journal)
    service = start(style, server, journal=journal)

    def started() -> None:
        where = f"style service of {run.path} at {service.address}"
        print(f"{where}, from {origin}, version {style.version}", flush=True)

    interrupted = service.run(lambda line: print(line, file=sys.stderr, flush=True), started)
    return INTERRUPTED if interrupted else 0


def version_of(state: Mapping[str, Tensor]) -> int:
    """Return the number of trainings of a saved state."""
    version = state.get("counters/version")
    return -1 if version is None or version.numel() != 1 else int(version)


def restore(style: Discriminator, saved: State, journal: Journal | None) -> None:
    """Restore a checkpoint's state in the discriminator and in its journal.

    The journal is cleared first, as its replay file belongs to its former state.
    """
    style.check_state(saved)
    if journal is not None:
        journal.clear()
    style.load_state_dict(saved)
    if journal is not None:
        journal.save(style.state_dict(replay=False))


def listening(command: Style | Serve) -> ServerConfig:
    """Return the server configuration of the flags; ConfigError for what is no address, and for
    flags that contradict one another or leave an address unprotected."""
    named = {"--listen": command.listen, "--metrics": command.metrics, "--health": command.health}
    for flag, address in named.items():
        if address and not (address.startswith("unix:") and flag != "--metrics"):
            try:
                split_address(address)
            except RpcError as error:
                raise ConfigError(f"{flag}: {error}") from None
    config = ServerConfig(
        listen=command.listen,
        tls_cert=_text(command.tls_cert),
        tls_key=_text(command.tls_key),
        tls_client_ca=_text(command.tls_client_ca),
        token_file=_text(command.token_file),
        allow_insecure_remote=command.allow_insecure_remote,
        metrics=command.metrics or "",
        health=command.health or "",
    )
    with flags_named():
        check(config)
        if config.token_file:
            read_token(config.token_file)
        if config.tls_cert:
            server_credentials(config.tls_cert, config.tls_key, config.tls_client_ca)
    return config


def _text(path: Path | None) -> str:
    return "" if path is None else str(path)
