"""`inhabit completion`: scripts that complete commands, flags and values in bash, zsh and fish.

A script holds tables of all commands and needs no Python at the Tab key. Runs are looked for in the
folder `runs` when the key is pressed; policies are those of the package that wrote the script.
"""

import shlex
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import resources

from console import commands
from console.manual import page, values
from console.manual.fields import Field
from console.manual.values import Values
from console.run.experiment import PRESETS

#: Marks of a table's row: files, and runs; numbers of values that a flag takes.
FILES, RUNS = "@files", "@runs"
NONE, ONE, MANY = "0", "1", "+"


@dataclass(frozen=True)
class Command:
    """What completes the words after one command."""

    name: str
    """Its words, as in `motions list`."""
    about: str
    words: tuple[Field, ...]
    """The words without a flag, in their order."""
    flags: tuple[Field, ...]


def completion_command(command: commands.Completion) -> int:
    """Print the script of a shell; return the exit code."""
    print(script(command.shell), end="")
    return 0


def script(shell: commands.Shell) -> str:
    """Return the script of a shell."""
    text = (resources.files("console.manual") / "data" / f"completion.{shell}").read_text()
    found = list(all_commands())
    table = {"bash": _cases, "zsh": _cases, "fish": _switch}[shell]
    described = shell != "bash"
    return (
        text.replace("#COMMANDS#", table(list(command_rows(described))))
        .replace("#FLAGS#", table(list(flag_rows(found, described))))
        .replace("#VALUES#", table(list(value_rows(found))))
    )


def all_commands() -> Iterator[Command]:
    """Yield every command, those of groups too."""
    entries = [("", entry) for entry in commands.COMMANDS]
    entries += [(f"{group.name} ", entry) for group in commands.GROUPS for entry in group.entries]
    for group, entry in entries:
        # the defaults of train are those of its preset
        train = entry.flags is commands.Train
        preset = commands.Train(task="", experiment=PRESETS["fast"]) if train else None
        found = page.flags_of(entry.flags, preset)
        yield Command(
            group + entry.name,
            page.summary(entry.flags),
            tuple(f for f in found if f.positional),
            tuple(f for f in found if not f.positional),
        )


Row = tuple[str, list[str]]
"""A key, and the words that it stands for."""


def command_rows(described: bool) -> Iterator[Row]:
    """Yield the commands after nothing, and after each group; described: with what they are for."""

    def shown(entry: commands.Entry | commands.Group) -> str:
        about = page.summary(entry.flags)
        return f"{entry.name}\t{about}" if described else entry.name

    yield "", [shown(entry) for entry in (*commands.COMMANDS, *commands.GROUPS)]
    for group in commands.GROUPS:
        yield group.name, [shown(entry) for entry in group.entries]


def flag_rows(found: list[Command], described: bool) -> Iterator[Row]:
    """Yield the flags of each command; described: with their meaning."""
    common = [("--help", "The flags that are wanted first."), (page.ALL, "All flags.")]
    for command in found:
        told = [(flag.typed, page.first_sentence(flag.meaning)) for flag in command.flags]
        rows = [f"{name}\t{about}" if described else name for name, about in (*told, *common)]
        yield command.name, rows


def value_rows(found: list[Command]) -> Iterator[Row]:
    """Yield what completes the values of each flag, and of each word without one: its key is its
    number from 1, or `+` for all further ones."""
    for command in found:
        for flag in command.flags:
            number = NONE if not flag.word else MANY if flag.many else ONE
            yield f"{command.name} {flag.typed}", [number, *_marks(values.of(flag))]
        for index, word in enumerate(command.words, 1):
            key = MANY if word.many else str(index)
            yield f"{command.name} {key}", [MANY, *_marks(values.of(word))]


def _marks(found: Values) -> list[str]:
    return [*found.words, *([RUNS] if found.runs else []), *([FILES] if found.files else [])]


def _lines(rows: list[Row], line: Callable[[str, str], str]) -> str:
    return "\n".join(line(shlex.quote(key), " ".join(map(shlex.quote, row))) for key, row in rows)


def _cases(rows: list[Row]) -> str:
    """Return rows as cases of bash and zsh, which set `reply`."""
    return _lines(rows, lambda key, words: f"    {key}) reply=({words}) ;;")


def _switch(rows: list[Row]) -> str:
    """Return rows as cases of fish, which print one word a line."""

    def quoted(text: str) -> str:
        return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"

    return "\n".join(
        f"        case {quoted(key)}\n            printf '%s\\n' {' '.join(map(quoted, row))}"
        for key, row in rows
    )
