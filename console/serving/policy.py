"""`inhabit serve`: the policy service of one or more runs."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from console.commands import Serve
from console.serving import loading
from console.serving.style import listening
from console.terminal import INTERRUPTED
from policy.checkpoints.reload import Source
from policy.service.servicer import PolicyService, serve
from rpc.aio_server import AioServer, run
from world.errors import ConfigError


def serve_command(command: Serve) -> int:
    """Serve until SIGTERM or Ctrl-C, then drain; return the exit code, 0 after SIGTERM."""
    if command.max_message_mb <= 0 or command.drain_s < 0:
        raise ConfigError("--max-message-mb must be above 0, --drain-s at least 0")
    config = replace(
        listening(command),
        drain_s=command.drain_s,
        max_message_bytes=round(command.max_message_mb * (1 << 20)),
    )
    sources = sources_of(command.sources, command.checkpoint)

    def started(server: AioServer, service: PolicyService) -> None:
        for name, follower in service.followers.items():
            served = follower.served
            print(f"{name}: task {served.task.name}, version {served.version}", flush=True)
        print(f"policy service at {server.address}", flush=True)

    interrupted = run(serve(sources, config, command.service, _say, started))
    return INTERRUPTED if interrupted else 0


def sources_of(words: Sequence[str], which: loading.Which) -> list[Source]:
    """Return the policies of RUN and NAME=RUN words; ConfigError for two of the same name."""
    if not words:
        raise ConfigError("RUN: give at least one run or checkpoint folder")
    found: dict[str, Source] = {}
    for word in words:
        name, equals, where = word.partition("=")
        path = Path(where) if equals else Path(word)
        if not equals:
            name = loading.task_of(loading.checkpoint_of(path, which))
        if not name:
            raise ConfigError(f"'{word}': must be RUN or NAME=RUN")
        if name in found:
            raise ConfigError(f"two policies have the name '{name}': give one, as {name}2={path}")
        found[name] = loading.source(name, path, which)
    return list(found.values())


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
