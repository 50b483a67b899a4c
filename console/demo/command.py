"""`inhabit demo`: a furnished room in a browser, until Ctrl-C."""

from collections.abc import Iterable
from pathlib import Path

import torch

import pretrained
from console.commands.demo import Demo
from console.demo.controls import RoomControls
from console.demo.layout import furnished
from console.demo.room import Room
from console.demo.source import RoomFrames
from console.play import server
from console.play.browser.view import View
from console.play.command import serve
from console.play.session import Session
from console.serving import loading
from policy.checkpoints import licences
from policy.checkpoints.format import read_manifest
from policy.checkpoints.served import Served
from world import tasks
from world.errors import ConfigError

#: Initial camera: position and look-at point, m.
_CAMERA, _LOOK_AT = (0.2, -5.4, 3.7), (0.1, -0.3, 0.2)


def demo_command(command: Demo) -> int:
    """Serve the page until Ctrl-C."""
    torch.set_num_threads(1)
    if command.seed < 0:
        raise ConfigError(f"--seed {command.seed}: choose 0 or more")
    found = policies(command.policies)
    room = Room(found, furnished(command.seed), command.seed)
    room.wanders = True
    page = server.start(command.listen, command.allow_insecure_remote)
    view = View(page, Session(RoomFrames(room)), "inhabit demo", plots=False)
    view.look(_CAMERA, _LOOK_AT)
    RoomControls(view, room, missing(found))
    view.offer_saving(recording=False)
    return serve(view, command.open)


def policies(words: Iterable[str]) -> dict[str, Served]:
    """The policies by task: the package's, and those of RUN words instead. Of two of the package's
    policies for a task it is the one that anyone may use.

    Raises InhabitError, in one line, for a word that is no policy, for one that follows clips, and
    for two of one task.
    """
    found = {
        task: pretrained.ROOT / name
        for name in sorted(pretrained.names(), key=_is_free)
        if not tasks.make(task := loading.task_of(pretrained.ROOT / name)).affordance.follows_clips
    }
    named: dict[str, str] = {}
    for word in words:
        path = loading.checkpoint_of(Path(word), "best")
        task = loading.task_of(path)
        if tasks.make(task).affordance.follows_clips:
            raise ConfigError(
                f"{word} follows clips, of which a room has none: choose policies of"
                f" {', '.join(_playable())}"
            )
        if task in named:
            raise ConfigError(
                f"{named[task]} and {word} are both policies of {task}: a room has one of each"
                " task, leave one out"
            )
        named[task], found[task] = word, path
    return {task: loading.served(task, path).check() for task, path in found.items()}


def _is_free(name: str) -> bool:
    """Anyone may use the package's policy of this name."""
    licence = read_manifest(pretrained.ROOT / name).notes.get("licence", "")
    return licences.NO_COMMERCE not in licences.restrictions(licence)


def _playable() -> list[str]:
    """The tasks of a room: those that follow no clips."""
    return [name for name in tasks.REGISTRY if not tasks.make(name).affordance.follows_clips]


def missing(found: Iterable[str]) -> str:
    """What the page says about tasks without a policy, as Markdown; empty without any."""
    have = set(found)
    lack = [name for name in _playable() if name not in have]
    if not lack:
        return ""
    return (
        f"*Not here: {' and '.join(lack)}. What there is was trained on research-only motions, so "
        "an installed package does not bring it. A checkout of the repository does, in "
        f"`pretrained/`: `inhabit demo PATH/TO/pretrained/{lack[0]}`. Or train your own: "
        f"`inhabit train {lack[0]}`, then `inhabit demo runs/...`.*"
    )
