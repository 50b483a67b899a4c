"""Connection of a training to a standalone style service."""

import json
import os
import re
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict

import numpy as np

from console.commands.training import StyleAddress
from console.run import assembly
from console.run.directory import RunDirectory, RunError
from console.run.experiment import Experiment, differences
from discriminator.client import MOCAP_MEAN, StyleClient
from discriminator.errors import StyleError
from rpc.channel import ChannelConfig, token_of
from rpc.errors import SettingsError
from world.errors import ConfigError

#: Means of mocap that differ by less are equal: another processor may round otherwise.
_SAME_MEAN = 1e-4


def channel_config(style: StyleAddress) -> ChannelConfig:
    """Return the channel configuration of the flags."""
    return ChannelConfig(
        address=style.address,
        tls_ca=str(style.tls_ca or ""),
        tls_cert=str(style.tls_cert or ""),
        tls_key=str(style.tls_key or ""),
        token_file=str(style.token_file or ""),
    )


def require(style: StyleAddress) -> None:
    """Raise ConfigError for an invalid address or token file, and where the token would be shown
    to others."""
    try:
        token_of(channel_config(style))
    except SettingsError as error:
        raise ConfigError(f"--style-service: {error}") from None


def secret_of(run: RunDirectory) -> str:
    """Return the id by which a style service knows the run; made once, readable by its owner
    alone.

    Raises RunError where it cannot be kept.
    """
    path = run.path / "style-service.id"
    try:
        with suppress(FileExistsError):
            run.path.mkdir(parents=True, exist_ok=True)
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(handle, "w") as file:
                file.write(secrets.token_hex(16))
        found = path.read_text().strip()
    except (OSError, ValueError) as error:
        raise RunError(f"cannot use {path}: {error}") from error
    if not re.fullmatch(r"[0-9a-f]{32}", found):
        raise RunError(f"{path} is damaged: remove it, and start the style service anew")
    return found


@contextmanager
def attached(
    style: StyleAddress, experiment: Experiment, note: Callable[[str], None], run: RunDirectory
) -> Iterator[StyleClient]:
    """Yield a client of the service, whose discriminator is reset to this experiment's initial one.

    The numbers are then those of a service of the run's own, which alone may use it from then on,
    also when it resumes. Raises StyleError for a service with
    other settings, RpcError for one that cannot be reached.
    """
    client = StyleClient(channel_config(style), note, training=secret_of(run))
    try:
        theirs = json.loads(client.status().config)
        mocap = theirs.pop(MOCAP_MEAN, None)
        ours = json.loads(json.dumps(asdict(experiment.style)))
        if changed := list(differences(theirs, ours, "style")):
            raise StyleError(
                f"the style service at {style.address} has other settings: {'; '.join(changed)}"
                " (start it for this run: inhabit style RUN)"
            )
        own = assembly.discriminator(experiment)
        if mocap is not None and not np.allclose(mocap, own.mocap_mean, atol=_SAME_MEAN):
            raise StyleError(
                f"the style service at {style.address} has other clips, or another seed (start it"
                " for this run: inhabit style RUN)"
            )
        client.load_state_dict(own.state_dict())
        yield client
    finally:
        client.close()
