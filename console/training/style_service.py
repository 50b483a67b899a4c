"""Connection of a training to a standalone style service."""

import json
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict

from console.commands.training import StyleAddress
from console.run import assembly
from console.run.experiment import Experiment, differences
from discriminator.client import StyleClient
from discriminator.errors import StyleError
from rpc.channel import ChannelConfig


def channel_config(style: StyleAddress) -> ChannelConfig:
    """Return the channel configuration of the flags."""
    return ChannelConfig(
        address=style.address,
        tls_ca=str(style.tls_ca or ""),
        tls_cert=str(style.tls_cert or ""),
        tls_key=str(style.tls_key or ""),
        token_file=str(style.token_file or ""),
    )


@contextmanager
def attached(
    style: StyleAddress, experiment: Experiment, note: Callable[[str], None]
) -> Iterator[StyleClient]:
    """Yield a client of the service, whose discriminator is reset to this experiment's initial one.

    The numbers are then those of a service of the run's own. Raises StyleError for a service with
    other settings, RpcError for one that cannot be reached.
    """
    client = StyleClient(channel_config(style), note, training=secrets.token_hex(16))
    try:
        theirs = json.loads(client.status().config)
        ours = json.loads(json.dumps(asdict(experiment.style)))
        if changed := list(differences(theirs, ours, "style")):
            raise StyleError(
                f"the style service at {style.address} has other settings: {'; '.join(changed)}"
                " (start it for this run: inhabit style RUN)"
            )
        client.load_state_dict(assembly.discriminator(experiment).state_dict())
        yield client
    finally:
        client.close()
