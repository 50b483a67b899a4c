"""`inhabit play`: a run's policy, a recording or clips in a browser, until Ctrl-C."""

import time
import webbrowser
from pathlib import Path

import torch

from console.commands.play import Play
from console.evaluation.tracking import notice, shown
from console.listening import joined
from console.play import recorded, server, stock
from console.play.browser.controls import Controls
from console.play.browser.ghost import Ghost
from console.play.browser.view import View
from console.play.recorded import Recorded, takes_of
from console.play.session import Session
from console.play.source import HZ, Source
from console.run import assembly, machine
from policy.checkpoints.served import Served
from world import tasks
from world.errors import ClipError, ConfigError

#: Clips that a policy which follows them shows, at most.
_MOST = 24


def play_command(command: Play) -> int:
    """Serve the page until Ctrl-C."""
    torch.set_num_threads(1)
    if not command.sources:
        raise ConfigError("RUN|FILE: give a run, a checkpoint folder, a recording or a clip")
    files = [word for word in command.sources if Path(word).is_file()]
    if files and len(command.sources) > 1:
        raise ConfigError(f"'{files[0]}' is a file: play one file, or runs")
    view = of_file(command, Path(files[0])) if files else of_runs(command)
    return serve(view, command.open)


def serve(view: View, opens: bool) -> int:
    """Print the address of a view, open it in a browser if asked to, and advance it until
    Ctrl-C."""
    address = f"http://{joined(view.server.get_host(), view.server.get_port())}/"
    print(f"{view.title} at {address} (Ctrl-C ends)", flush=True)
    if opens:
        webbrowser.open(address)
    try:
        run(view)
    finally:
        view.server.stop()
    return 0


def run(view: View) -> None:
    """Advance the view at the control rate, or slower on a slow machine."""
    before = time.perf_counter()
    while True:
        began = time.perf_counter()
        view.tick(began - before)
        before = began
        time.sleep(max(0.0, 1.0 / HZ - (time.perf_counter() - began)))


def of_runs(command: Play) -> View:
    """The page of live policies; of one that follows clips, what it does with each of them."""
    if len(command.sources) == 1 and (trained := follower(command)) is not None:
        if line := notice(trained):
            print(line, flush=True)
        return of_takes(
            command, takes_of(shown(trained, _MOST, machine.cores()), trained.task), trained.task
        )
    found = stock.load(command.sources, command.checkpoint, command.objects)
    setup = found.first()
    session = Session(found.begin(setup), found)
    title = f"inhabit play: {', '.join(found.policies)}"
    view = View(server.start(command.listen, command.allow_insecure_remote), session, title)
    Controls(view, found, setup)
    view.offer_ghost(lambda: ghost_of(command, found.policy(setup.policy)))
    view.offer_saving()
    return view


def of_file(command: Play, path: Path) -> View:
    """The page of a recording or of clips."""
    return of_takes(command, recorded.read(path), path.name)


def follower(command: Play) -> assembly.Trained | None:
    """The policy that is to be played, if it follows clips."""
    word = str(command.sources[0])
    source = word if Path(word).exists() else word.partition("=")[2] or word
    trained = assembly.trained(Path(source))
    return trained if tasks.make(trained.task).affordance.follows_clips else None


def of_takes(command: Play, takes: dict[str, Recorded], name: str) -> View:
    """The page of what was recorded."""
    found: dict[str, Source] = dict(takes)
    session = Session(next(iter(found.values())))
    title = f"inhabit play: {name}"
    view = View(server.start(command.listen, command.allow_insecure_remote), session, title)
    if len(found) > 1:
        chosen = view.server.gui.add_dropdown("take", tuple(found), order=-1.0)
        view.on(chosen, lambda _: session.use(found, str(chosen.value)))
    if not any(take.follows for take in takes.values()):
        view.offer_ghost(lambda: ghost_of(command, None))
    view.offer_saving()
    return view


def ghost_of(command: Play, served: Served | None) -> tuple[Ghost | None, str]:
    """Return the ghost and a text on its clips, or None and the reason.

    The clips are those of --motions, else the policy's training clips if they exist.
    """
    torch.set_num_threads(1)
    if command.motions:
        paths = tuple(str(path) for path in command.motions)
        task = "sit" if served is None else served.task.name
        return Ghost(assembly.library(paths, False, task)), "among the given clips"
    if served is None:
        return None, "no clips to compare with: give --motions DIR"
    world = served.world
    try:
        ghost = Ghost(assembly.library(world.motions, False, world.task))
    except ClipError as error:
        return None, f"the training clips are missing ({error}): give --motions DIR"
    return ghost, "among the policy's clips" if world.motions else "among the package's own clips"
