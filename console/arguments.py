"""Parsing of the command line to a command's dataclass, with errors of one line."""

import contextlib
import dataclasses
import io
import re
import sys
from collections.abc import Sequence
from typing import Any

import tyro
from tyro.constructors import (
    ConstructorRegistry,
    StructConstructorSpec,
    StructFieldSpec,
    StructTypeInfo,
)

# tyro exports its dataclass rule under no public name; its version is pinned
from tyro.constructors._struct_spec_dataclass import dataclass_rule

from console import bounds
from world.errors import ConfigError

_STYLING = re.compile(r"\x1b\[[0-9;]*m")
_RULE = re.compile(r"[-─]{3,}")


class ArgumentError(ConfigError):
    """A command, flag or value that is not among the valid ones."""


def parse_words(kind: Any, words: Sequence[str], prog: str, **settings: Any) -> Any:
    """Parse words by `tyro.cli` to a dataclass or a union of them.

    Raises ArgumentError, in one line, for invalid words, and SystemExit with 0 after --help.
    """
    messages = io.StringIO()
    try:
        with contextlib.redirect_stderr(messages):
            found = tyro.cli(kind, prog=prog, args=list(words), registry=_bounded(), **settings)
    except SystemExit as stop:
        if not stop.code:
            raise
        text = one_line(messages.getvalue()) or f"these arguments are no command; see {prog} --help"
        if "subcommands" not in text and words and not words[0].startswith("-"):
            text = text.replace(f"see {prog} --help", f"see {prog} {words[0]} --help")
        raise ArgumentError(text) from None
    sys.stderr.write(messages.getvalue())
    if dataclasses.is_dataclass(found):
        bounds.require(found)
    return found


def _bounded() -> ConstructorRegistry:
    """Return tyro's rule for dataclasses, extended by the bounds of numbers in the help."""
    registry = ConstructorRegistry()

    @registry.struct_rule
    def rule(info: StructTypeInfo) -> StructConstructorSpec | None:
        spec = dataclass_rule(info)
        if spec is None or not isinstance(info.type, type):
            return spec
        fields = tuple(_with_bounds(info.type, field) for field in spec.fields)
        return dataclasses.replace(spec, fields=fields)

    return registry


def _with_bounds(kind: type, field: StructFieldSpec) -> StructFieldSpec:
    form = bounds.text(kind, field.name)
    if not form:
        return field

    def text() -> str:
        own = field.helptext() if callable(field.helptext) else field.helptext
        return f"{(own or '').rstrip().rstrip('.')}; {form}." if own else f"{form}."

    return dataclasses.replace(field, helptext=text)


def one_line(box: str) -> str:
    """Return the message of tyro's error box in one line: the error, valid choices, the help.

    Suggested flags are given by name alone. Other text is joined to one line.
    """
    rows = [_STYLING.sub("", row) for row in box.splitlines()]
    sections: list[list[str]] = [[]]
    for row in _inside(rows):
        if _RULE.fullmatch(row.strip()):
            sections.append([])
        elif row.strip():
            sections[-1].append(row)
    parts = [_section(section) for section in sections]
    return "; ".join(part.rstrip(".") for part in parts if part)


def _inside(rows: list[str]) -> list[str]:
    """Return the rows without title and frame."""
    framed = [row[2:-1].rstrip() for row in rows if row.startswith("│")]
    if framed:
        return framed
    # With an ASCII-only standard output tyro prints a title, a rule, then rows indented by two.
    if len(rows) > 1 and _RULE.fullmatch(rows[1].strip()):
        return [row[2:].rstrip() for row in rows[2:]]
    return rows


def _section(rows: list[str]) -> str:
    title = rows[0].strip() if rows else ""
    if title.startswith("Argument helptext"):
        return ""
    if title.startswith(("Perhaps you meant", "Arguments similar to")):
        flags = dict.fromkeys(row.split()[0].rstrip(",") for row in rows if row[:6] == "    --")
        return f"{title} {', '.join(flags)}"
    text = " ".join(" ".join(row.split()) for row in rows)
    return re.sub(r"^For full helptext, (run|see):? ", "see ", text)
