"""Parsing of the command line to a command's dataclass, with errors of one line."""

import contextlib
import dataclasses
import io
import sys
import typing
from collections.abc import Collection, Iterator, Sequence
from typing import Annotated, Any

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
from console.parse_errors import one_line
from console.run.experiment import Experiment
from console.run.renamed import REPEATED
from world.errors import ConfigError


class ArgumentError(ConfigError):
    """A command, flag or value that is not among the valid ones."""


def parse_words(
    kind: Any,
    words: Sequence[str],
    prog: str,
    hidden: Collection[tuple[type, str]] = (),
    **settings: Any,
) -> Any:
    """Parse words by `tyro.cli` to a dataclass or a union of them.

    hidden: dataclass and field of flags that the help leaves out. Raises ArgumentError, in one
    line, for invalid words, and SystemExit with 0 after --help.
    """
    messages = io.StringIO()
    # The help shows the one of a pair that changes something. Both are taken, as a script that
    # resumes repeats its flags, whatever the run's settings are.
    asked = {"--help", "-h"} & set(words)
    try:
        with contextlib.redirect_stderr(messages):
            found = tyro.cli(
                kind,
                prog=prog,
                args=list(words),
                registry=_registry(hidden),
                config=(tyro.conf.FlagCreatePairsOff,) if asked else (),
                **settings,
            )
    except SystemExit as stop:
        if not stop.code:
            raise
        named = words and not words[0].startswith("-")
        command = f"{prog} {words[0]}" if named else prog
        raise ArgumentError(one_line(messages.getvalue(), command)) from None
    sys.stderr.write(messages.getvalue())
    if dataclasses.is_dataclass(found):
        bounds.require(found)
    return found


def _registry(hidden: Collection[tuple[type, str]]) -> ConstructorRegistry:
    """Return tyro's rule for dataclasses, extended: bounds of numbers are in the help, hidden flags
    are not, and settings that another flag sets have no flag."""
    registry = ConstructorRegistry()
    repeated = set(_repeated())

    @registry.struct_rule
    def rule(info: StructTypeInfo) -> StructConstructorSpec | None:
        spec = dataclass_rule(info)
        if spec is None or not isinstance(info.type, type):
            return spec
        fields: list[StructFieldSpec] = []
        for field in spec.fields:
            key = (info.type, field.name)
            shown = _with_bounds(info.type, field)
            if key in repeated:
                shown = dataclasses.replace(shown, type=Annotated[shown.type, tyro.conf.Fixed])
            if key in repeated or key in hidden:
                shown = dataclasses.replace(shown, type=Annotated[shown.type, tyro.conf.Suppress])
            fields.append(shown)
        return dataclasses.replace(spec, fields=tuple(fields))

    return registry


def _repeated() -> Iterator[tuple[type, str]]:
    """Yield dataclass and field of each setting that another flag sets."""
    for key in REPEATED:
        kind: type = Experiment
        *groups, name = key.split(".")
        for group in groups:
            kind = typing.get_type_hints(kind)[group]
        yield kind, name


def _with_bounds(kind: type, field: StructFieldSpec) -> StructFieldSpec:
    """Return a field whose help says its bounds, and that a flag --no-NAME turns it off."""
    form = bounds.text(kind, field.name)
    turns_off = field.default is True
    if not form and not turns_off:
        return field

    def text() -> str:
        own = field.helptext() if callable(field.helptext) else field.helptext
        own = f"Turns off: {own or ''}" if turns_off else own
        if not form:
            return own or ""
        return f"{(own or '').rstrip().rstrip('.')}; {form}." if own else f"{form}."

    return dataclasses.replace(field, helptext=text)
