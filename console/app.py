"""The `inhabit` command: reads flags, runs one command, and maps errors to exit codes."""

import contextlib
import importlib
import io
import os
import shlex
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
    from console.run.recipe import Recipe
    from console.run.stages import Before

DONE, FAILED, BAD_ARGUMENTS, INTERRUPTED = 0, 1, 2, 130


def parse(arguments: Sequence[str]) -> Any:
    """Parse the arguments to the dataclass of a command; ArgumentError if they name none."""
    from typing import Annotated

    import tyro

    from console import commands
    from console.arguments import parse_words
    from console.run.renamed import RENAMED_SERVE, refuse_old_flags, refuse_repeated_flags

    def sub(kind: type, name: str, default: Any = tyro.MISSING_NONPROP) -> Any:
        if default is tyro.MISSING_NONPROP:
            return Annotated[kind, tyro.conf.subcommand(name=name)]
        return Annotated[kind, tyro.conf.subcommand(name=name, default=default)]

    start, overrides = beginning(arguments)
    train = commands.Train(
        task=tyro.MISSING, experiment=start, preset=preset_of(arguments), overrides=overrides
    )

    def union(entries: Sequence[commands.Entry | commands.Group]) -> Any:
        kinds = [
            sub(e.flags, e.name, *([train] if e.flags is commands.Train else [])) for e in entries
        ]
        return reduce(or_, kinds)

    words = list(arguments)
    refuse_unknown_command(words)
    if words[:1] == ["train"]:
        refuse_old_flags(words)
        refuse_repeated_flags(words)
    if words[:1] == ["serve"]:
        refuse_old_flags(words, RENAMED_SERVE)
    hidden = settings_of_other_tasks(words)
    if start.before and not asks_for_help(words) and "--resume" not in words:
        require_before(start.before, value_of(words, "--recipe"))
    if asks_for_help(words):
        from console.manual import page

        if not page.has_all(words):
            print(page.of(words, DESCRIPTION, train, hidden))
            raise SystemExit(DONE)
        words = ["--help" if word == page.ALL else word for word in words]
    groups = {group.name: group for group in commands.GROUPS}
    if words[:1] and words[0] in groups:
        # Two words deep: tyro would name these `motions:list`.
        group, name = groups[words[0]], f"inhabit {words[0]}"
        about = " ".join((group.flags.__doc__ or "").split())
        return parse_words(union(group.entries), words[1:], name, description=about)
    everything = (*commands.COMMANDS, *commands.GROUPS)
    return parse_words(union(everything), words, "inhabit", hidden, description=DESCRIPTION)


DESCRIPTION = (
    "Trains simulated characters to use furniture that is not in the training set."
    " `inhabit COMMAND --help` shows the flags that are wanted first, `--help-all` all of them;"
    " `inhabit --version` prints the version."
)


def refuse_unknown_command(words: Sequence[str]) -> None:
    """Raise ArgumentError for a command, or a task of `train`, that does not exist, also where the
    words ask for help."""
    from console import commands
    from console.arguments import ArgumentError

    entries = (*commands.COMMANDS, *commands.GROUPS)
    groups = {group.name: [entry.name for entry in group.entries] for group in commands.GROUPS}
    name = words[0] if words else "-"
    if not name.startswith("-") and name not in {entry.name for entry in entries}:
        choices = ", ".join(entry.name for entry in entries)
        raise ArgumentError(
            f"{name}: no command of inhabit: choose one of {choices}; see inhabit --help"
        )
    inner = next((word for word in words[1:] if not word.startswith("-")), "-")
    if name in groups and inner != "-" and inner not in groups[name]:
        raise ArgumentError(
            f"{inner}: no command of inhabit {name}: choose one of {', '.join(groups[name])};"
            f" see inhabit {name} --help"
        )


def asks_for_help(words: Sequence[str]) -> bool:
    """Return whether the words ask for help instead of the command."""
    return bool({"--help", "-h", "--help-all"} & set(words))


def settings_of_other_tasks(words: Sequence[str]) -> frozenset[tuple[type, str]]:
    """Return the settings that the help of `train TASK` leaves out, as dataclass and field: those
    of other tasks alone, and those that its kind of object leaves unused. Raises ChoiceError for an
    unknown task.

    Only for help, as tasks take a second to import. A setting of one task alone has its name.
    """
    if words[:1] != ["train"] or not asks_for_help(words):
        return frozenset()
    from console import commands
    from world import tasks
    from world.config import InitialStates, WorldConfig

    task = words[1] if not words[1].startswith("-") else ""
    if not task:
        return frozenset()
    unused = tasks.make(task).affordance.unused
    inner = {name.partition(".")[2] for name in unused}
    return frozenset(
        {(WorldConfig, name) for name in tasks.REGISTRY if name != task}
        | {(WorldConfig, name) for name in unused}
        | {(InitialStates, name) for name in inner - {""}}
        | ({(commands.Train, "objects")} if "objects" in unused else set())
    )


def starting_point(arguments: Sequence[str]) -> "Experiment":
    """Return the defaults of the flags of `train`; see `beginning`."""
    return beginning(arguments)[0]


def beginning(arguments: Sequence[str]) -> "tuple[Experiment, tuple[str, ...]]":
    """Return the defaults of the flags of `train`, and lines on what the flags override: the run's
    settings with --resume, else those of a recipe or a preset."""
    from console.run import recipe as recipes
    from console.run.directory import RunDirectory
    from console.run.experiment import PRESETS, read_experiment

    if "--resume" in arguments:
        run = value_of(arguments, "--run")
        if run and (Path(run) / "config.json").exists():
            return read_experiment(RunDirectory(Path(run))), ()
    if recipe := recipe_of(arguments):
        return recipes.start(recipe, recipes.explicit_settings(arguments))
    return PRESETS.get(preset_of(arguments), PRESETS["fast"]), ()


def recipe_of(arguments: Sequence[str]) -> "Recipe | None":
    """Return the recipe of `train TASK --recipe`; None without one.

    Raises ChoiceError for an unknown name, ConfigError for an invalid file or another --preset.
    """
    from console.run import recipe as recipes

    name = value_of(arguments, "--recipe")
    if list(arguments[:1]) != ["train"] or not name or name.startswith("--"):
        return None
    task = next((word for word in arguments[1:2] if not word.startswith("-")), "")
    found = recipes.find(name, task)
    given = value_of(arguments, "--preset")
    if given not in (None, found.preset):
        raise ConfigError(
            f"--preset {given}: the recipe {name} is of the preset {found.preset}: leave one out"
        )
    return found


def require_before(before: "Sequence[Before]", recipe: str | None) -> None:
    """Raise ConfigError for a run before that of a recipe whose command is wrong, hours before it
    is reached."""
    from world import tasks  # takes a second, which most commands need not wait

    for one in before:
        here = f"{recipe}: before {one.name}: command"
        words = shlex.split(one.command)
        if words[0] == "distill":
            words.insert(2, one.name)
        try:
            tasks.make(words[1])
            inner = recipe_of(words)
            if inner is not None and inner.before:
                raise ConfigError(f"the recipe {inner.name} has runs before its own: name those")
            parse(words)
        except (ChoiceError, ConfigError) as error:
            raise ConfigError(f"{here}: {error}") from None


def preset_of(arguments: Sequence[str]) -> Any:
    """Return the preset of --preset, else that of the recipe, else the one with the task's name,
    else fast."""
    from console.run.experiment import PRESETS

    given = value_of(arguments, "--preset")
    if given is None and (recipe := recipe_of(arguments)):
        return recipe.preset
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

    inner = (entry for group in commands.GROUPS for entry in group.entries)
    entries = (*commands.COMMANDS, *inner)
    module, _, function = next(e.function for e in entries if e.flags is type(command)).partition(
        ":"
    )
    from console.terminal import doing

    with doing("starting"):  # the simulator and the networks take seconds to import
        found = getattr(importlib.import_module(module), function)
    if isinstance(command, commands.Train):  # a recipe may have commands that come before
        return found(command, lambda words: execute(parse(words), words))
    return found(command)


def execute(command: Any, words: Sequence[str]) -> int:
    """Run one parsed command whose inputs are there and whose outputs can be, after a line on a
    MUJOCO_GL that is not; return the exit code."""
    from console import inputs, outputs, terminal

    if surroundings.missing_gl is not None and words[:1] != ["doctor"]:
        print(f"inhabit: {surroundings.missing_gl}: ignored", file=sys.stderr, flush=True)
    with terminal.doing("starting"):
        inputs.require(command)
        outputs.require(command, tuple(inputs.files(command)))
        for line in dict.fromkeys(inputs.namesakes(command)):
            terminal.note(line)
    return run(command)


def exit_code(error: BaseException) -> int:
    """Return the exit code of an error: 2 for a wrong command line, 1 for a failure."""
    from rpc.errors import SettingsError

    wrong = isinstance(error, ChoiceError | ConfigError | SettingsError)
    return BAD_ARGUMENTS if wrong else FAILED


def one_line(error: BaseException) -> str:
    """Return the error as one line, with its type where it is not an error of this project."""
    text = " ".join(str(error).split()) or type(error).__name__
    if isinstance(error, EXPECTED):
        return text
    if isinstance(error, OSError) and error.filename is not None and error.strerror:
        name = os.fsdecode(error.filename) if isinstance(error.filename, bytes) else error.filename
        return f"{name}: {error.strerror} (--debug shows where)"
    return f"{type(error).__name__}: {text} (--debug shows where)"


SERVICES = (["serve"], ["style"], ["play"], ["demo"])
"""Commands that wait for others once they run."""


def version() -> str:
    """Return the version of the installed package."""
    from importlib import metadata

    try:
        return metadata.version("inhabit")
    except metadata.PackageNotFoundError:
        return "(not installed: run from its folder)"


def _expected() -> tuple[type[BaseException], ...]:
    from rpc.errors import RpcError

    return InhabitError, RpcError


EXPECTED = _expected()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit code. A traceback is shown with --debug alone."""
    # Waiting OpenMP threads would otherwise spin on the cores that step the simulator.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    for stream in (sys.stdout, sys.stderr):
        # frames and bullets of tables, and names of files, where the encoding has no such character
        if isinstance(stream, io.TextIOWrapper):
            # each line at once, in a pipe too: a silence there is one
            stream.reconfigure(errors="backslashreplace", line_buffering=True)
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words == ["--version"]:
        print(f"inhabit {version()}")
        return DONE
    try:
        if arguments is not None:
            return execute(parse(words), words)
        from console import terminal

        serves = words[:1] in SERVICES or words[:2] == ["motions", "play"]
        name = " ".join(["inhabit", *words[:1]])
        with terminal.answering(), terminal.signs_of_life(name, serves, terminal.age_s()):
            with terminal.doing("starting"):
                command = parse(words)
            return execute(command, words)
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
