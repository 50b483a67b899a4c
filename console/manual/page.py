"""The text of `--help`: what a command is for and the flags that are wanted first, in a screen or
two. `--help-all` lists every flag with its bounds."""

import re
import shutil
import textwrap
from collections.abc import Collection, Iterator, Sequence
from typing import Any

from console import commands
from console.manual import fields
from console.manual.fields import Field
from console.manual.sections import COMMANDS, FLAGS, Section
from console.run.renamed import REPEATED

#: Widest text, columns; widths of the columns of commands and of flags; gap after them.
_WIDEST, _COMMANDS, _FLAGS, _GAP = 100, 12, 26, 2
#: Narrowest column of meanings beside the flags; on a narrower screen they stand below.
_NARROWEST = 34
DEBUG, ALL = "debug", "--help-all"


def of(
    words: Sequence[str],
    about: str,
    train: Any = None,
    hidden: Collection[tuple[type, str]] = (),
) -> str:
    """Return the help that the words of a command line ask for.

    about: what the program is for. train: an instance of Train with the defaults of its flags;
    hidden: dataclass and field of those that its help leaves out.
    """
    typed = [word for word in words if not word.startswith("-")]
    name = typed[0] if words and words[0] in typed else ""
    for found in commands.GROUPS:
        if found.name == name:
            inner = {entry.name: entry for entry in found.entries}
            if len(typed) < 2 or typed[1] not in inner:
                return group(found)
            return command(f"{name} {typed[1]}", inner[typed[1]].flags)
    for entry in commands.COMMANDS:
        if entry.name == name:
            if entry.flags is not commands.Train:
                return command(name, entry.flags)
            return command(name, entry.flags, train, hidden, task="".join(typed[1:2]))
    return top_level(about)


def has_all(words: Sequence[str]) -> bool:
    """Return whether the words ask for all flags of one command."""
    deep = {entry.name: [inner.name for inner in entry.entries] for entry in commands.GROUPS}
    typed = [word for word in words if not word.startswith("-")]
    if ALL not in words or words[0] not in typed:
        return False
    return words[0] not in deep or (len(typed) > 1 and typed[1] in deep[words[0]])


def top_level(about: str, width: int | None = None) -> str:
    """Return the help of `inhabit`: every command, by what a person wants."""
    width = width or columns()
    kinds = {entry.name: entry.flags for entry in (*commands.COMMANDS, *commands.GROUPS)}
    lines = ["usage: inhabit COMMAND ...", "", *_wrapped(about, width)]
    for section in COMMANDS:
        rows = [(name, summary(kinds[name])) for name in section.names]
        lines += ["", section.title, *_table(rows, _COMMANDS, width)]
    return "\n".join(lines)


def group(found: commands.Group, width: int | None = None) -> str:
    """Return the help of a command of several words: its commands."""
    width = width or columns()
    rows = [(entry.name, summary(entry.flags)) for entry in found.entries]
    lines = [f"usage: inhabit {found.name} COMMAND ...", ""]
    lines += [*_wrapped(_doc(found.flags), width), "", *_table(rows, _COMMANDS, width)]
    more = f"inhabit {found.name} COMMAND --help lists the flags of a command."
    return "\n".join([*lines, "", *_wrapped(more, width)])


def command(
    name: str,
    kind: type,
    default: Any = None,
    hidden: Collection[tuple[type, str]] = (),
    width: int | None = None,
    task: str = "",
) -> str:
    """Return the help of one command.

    name: its words, as in `motions list`. default: an instance with the defaults of the flags.
    hidden: dataclass and field of settings to leave out. task: the task of the words, for the last
    line.
    """
    width = width or columns()
    found = [f for f in flags_of(kind, default) if (f.owner, f.own_name) not in hidden]
    words = [f for f in found if f.positional]
    flags = {f.typed.removeprefix("--"): f for f in found if not f.positional}
    sections = FLAGS.get(kind) or (
        Section("Flags", tuple(name for name, f in flags.items() if f.name != DEBUG)),
    )
    needed = [f"{f.typed} {f.word}" for f in found if f.needed and not f.positional]
    usage = " ".join(["usage: inhabit", name, *map(_usage, words), *needed, "[flags]"])
    lines = [*_wrapped(usage, width, subsequent_indent="    "), ""]
    lines += _wrapped(_doc(kind), width)
    if words:
        rows = [(_usage(f), _word(f)) for f in words]
        lines += ["", *_table(rows, _FLAGS, width)]
    for section in sections:
        rows = [_row(flags[name]) for name in section.names if name in flags]
        if rows:
            lines += ["", section.title, *_table(rows, _FLAGS, width)]
    told = {name for section in sections for name in section.names}
    rest = len(set(flags) - told)
    typed = f"{name} {task}" if task else name
    more = f"{rest} more flag{'s' * (rest != 1)}, and all bounds: inhabit {typed} --help-all"
    return "\n".join([*lines, "", *_wrapped(more, width)])


def flags_of(kind: type, default: Any = None) -> list[Field]:
    """Return the words and flags of a command; settings that another flag sets have none."""
    return [f for f in fields.walk(kind, default) if f.name not in REPEATED]


def columns() -> int:
    """Return the width of the text: that of the terminal, at most _WIDEST."""
    return min(_WIDEST, shutil.get_terminal_size().columns)


def summary(kind: type) -> str:
    """Return what a command is for, in one clause; of a group, its whole docstring."""
    text = _doc(kind)
    if "|" in text.split()[0]:
        return text.rstrip(".")
    ends = [at for mark in (": ", "; ", ". ") if (at := text.find(mark)) > 0]
    return text[: min(ends)] if ends else text.rstrip(".")


def first_sentence(text: str) -> str:
    """Return a text up to its first full stop before a new sentence."""
    at = text.find(". ")
    return text if at < 0 else text[: at + 1]


def _doc(kind: type) -> str:
    return " ".join((kind.__doc__ or "").split())


def _usage(word: Field) -> str:
    """Return a word of the command line as in `RUN`, `[OUT.mp4]` or `RUN ...`."""
    given = word.word not in ("TEXT", "PATH") and not word.choices
    shown = word.word.removesuffix(" ...") if given else ""
    shown = (shown or word.name.upper()) + (" ..." if word.many else "")
    return shown if word.needed else f"[{shown}]"


def _word(word: Field) -> str:
    """Return the meaning of a word, with its valid values."""
    meaning = first_sentence(word.meaning)
    return f"{meaning.rstrip('.')}: {', '.join(word.choices)}." if word.choices else meaning


def _row(flag: Field) -> tuple[str, str]:
    meaning = first_sentence(flag.meaning)
    if flag.typed != flag.flag:
        meaning = f"Turns off: {meaning}"
    if flag.word and flag.default not in ("", "none") and "default" not in meaning:
        meaning = f"{meaning.rstrip('.')} (default: {flag.default})."
    return f"{flag.typed} {flag.word}".rstrip(), meaning


def _table(rows: Sequence[tuple[str, str]], left: int, width: int) -> Iterator[str]:
    """Yield the lines of rows of two columns; the second stands below the first where it is too
    narrow beside it."""
    beside = width - left - _GAP >= _NARROWEST or left <= _COMMANDS
    indent = left + _GAP if beside else 2 * _GAP
    for name, text in rows:
        parts = _wrapped(text, max(20, width - indent))
        start = f"{'':{_GAP}}{name}"
        if beside and len(start) + _GAP <= indent and parts:
            yield f"{start:{indent}}{parts.pop(0)}"
        else:
            yield from _folded(start, width)
        yield from (f"{'':{indent}}{part}" for part in parts)


def _folded(text: str, width: int) -> Iterator[str]:
    """Yield the lines of a flag with its values, broken after a space or a bar."""
    line = ""
    for part in re.split(r"(?<=[^ ][ |])", text):
        if line and len(line) + len(part.rstrip()) > width:
            yield line.rstrip()
            line = f"{'':{3 * _GAP}}"
        line += part
    yield line.rstrip()


def _wrapped(text: str, width: int, subsequent_indent: str = "") -> list[str]:
    """Return the lines of a text; flags are not broken at their hyphens."""
    return textwrap.wrap(text, width, subsequent_indent=subsequent_indent, break_on_hyphens=False)
