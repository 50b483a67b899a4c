"""The `inhabit` command: reads flags, runs one command, and maps errors to exit codes."""

import contextlib
import importlib
import os
import sys
import traceback
from collections.abc import Sequence
from functools import reduce
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Any

from world import surroundings
from world.errors import ChoiceError, ConfigError, InhabitError

if TYPE_CHECKING:
    from console.run.experiment import Experiment

DONE, FAILED, BAD_ARGUMENTS, INTERRUPTED = 0, 1, 2, 130


def parse(arguments: Sequence[str]) -> Any:
    """Parse the arguments to the dataclass of a command; ArgumentError if they name none."""
    from typing import Annotated

    import tyro

    from console import commands
    from console.arguments import parse_words
    from console.run.renamed import RENAMED_SERVE, refuse_old_flags

    def sub(kind: type, name: str, default: Any = tyro.MISSING_NONPROP) -> Any:
        if default is tyro.MISSING_NONPROP:
            return Annotated[kind, tyro.conf.subcommand(name=name)]
        return Annotated[kind, tyro.conf.subcommand(name=name, default=default)]

    train = commands.Train(
        task=tyro.MISSING, experiment=starting_point(arguments), preset=preset_of(arguments)
    )

    def union(entries: Sequence[commands.Entry]) -> Any:
        kinds = [
            sub(e.flags, e.name, *([train] if e.flags is commands.Train else [])) for e in entries
        ]
        return reduce(or_, kinds)

    words = list(arguments)
    if words[:1] == ["train"]:
        refuse_old_flags(words)
    if words[:1] == ["serve"]:
        refuse_old_flags(words, RENAMED_SERVE)
    # Two words deep: tyro would name these `motions:list`.
    if words[:1] == ["motions"]:
        return parse_words(
            union(commands.MOTIONS), words[1:], "inhabit motions", description=MOTIONS
        )
    if words[:1] == ["objects"]:
        return parse_words(
            union(commands.OBJECTS), words[1:], "inhabit objects", description=OBJECTS
        )
    if words[:1] == ["teach"]:
        return parse_words(union(commands.TEACHING), words[1:], "inhabit teach", description=TEACH)
    # the help shows the one of a pair that changes something; both are taken, as a script that
    # resumes repeats its flags, whatever the run's settings are
    asked = {"--help", "-h"} & set(words)
    settings = (tyro.conf.FlagCreatePairsOff,) if asked else ()
    return parse_words(
        union(commands.COMMANDS), words, "inhabit", description=DESCRIPTION, config=settings
    )


DESCRIPTION = (
    "Trains simulated characters to use furniture that is not in the training set. "
    "Besides the commands below: motions import|list|check|play, objects import|list|check|show,"
    " teach carry|try|record."
)
MOTIONS = "Motion clips: import, list and play them, or check how well they fit the character."
OBJECTS = "Furniture: import meshes; list, check and show pieces."
TEACH = "The scripted teacher of carry: train a student, evaluate the teacher, record clips."


def starting_point(arguments: Sequence[str]) -> "Experiment":
    """Return the defaults of the flags of `train`: the run's settings with --resume, else those of
    a preset."""
    from console.run.directory import RunDirectory
    from console.run.experiment import PRESETS, read_experiment

    if "--resume" in arguments:
        run = value_of(arguments, "--run")
        if run and (Path(run) / "config.json").exists():
            return read_experiment(RunDirectory(Path(run)))
    return PRESETS.get(preset_of(arguments), PRESETS["fast"])


def preset_of(arguments: Sequence[str]) -> Any:
    """Return the preset of --preset, else the one with the task's name, else fast."""
    from console.run.experiment import PRESETS

    given = value_of(arguments, "--preset")
    task = next((word for word in arguments[1:2] if word in PRESETS), "fast")
    # an unknown preset is refused when the flag is parsed
    return given if given in PRESETS else task


def value_of(arguments: Sequence[str], flag: str) -> str | None:
    """Return the value of a flag, from `--flag value` or `--flag=value`; None without the flag."""
    for here, following in zip(arguments, [*arguments, None][1:], strict=True):
        if here == flag:
            return following
        if here.startswith(f"{flag}="):
            return here.partition("=")[2]
    return None


def run(command: Any) -> int:
    """Run one parsed command; return its exit code."""
    from console import commands

    entries = (*commands.COMMANDS, *commands.MOTIONS, *commands.OBJECTS, *commands.TEACHING)
    module, _, function = next(e.function for e in entries if e.flags is type(command)).partition(
        ":"
    )
    return getattr(importlib.import_module(module), function)(command)


def exit_code(error: BaseException) -> int:
    """Return the exit code of an error: 2 for a wrong command line, 1 for a failure."""
    return BAD_ARGUMENTS if isinstance(error, ChoiceError | ConfigError) else FAILED


def one_line(error: BaseException) -> str:
    """Return the error as one line, with its type where it is not an error of this project."""
    text = " ".join(str(error).split()) or type(error).__name__
    if isinstance(error, EXPECTED):
        return text
    return f"{type(error).__name__}: {text} (--debug shows where)"


def _expected() -> tuple[type[BaseException], ...]:
    from rpc.errors import RpcError

    return InhabitError, RpcError


EXPECTED = _expected()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit code. A traceback is shown with --debug alone."""
    # Waiting OpenMP threads would otherwise spin on the cores that step the simulator.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        command = parse(words)
        if surroundings.missing_gl is not None and words[:1] != ["doctor"]:
            print(f"inhabit: {surroundings.missing_gl}: ignored", file=sys.stderr, flush=True)
        return run(command)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else DONE if stop.code is None else FAILED
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except Exception as error:
        if "--debug" in words:
            traceback.print_exc()
        print(f"inhabit: {one_line(error)}", file=sys.stderr)
        return exit_code(error)
