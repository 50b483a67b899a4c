"""Dataclass fields with their docstrings, types, defaults and units."""

import ast
import dataclasses
import inspect
import re
import textwrap
import types
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from console import bounds

#: How field names end, and the unit that they then have.
SUFFIXES = {
    "_m_s": "m/s",
    "_rad_s": "rad/s",
    "_deg": "°",
    "_rad": "rad",
    "_kg": "kg",
    "_nm": "N·m",
    "_hz": "Hz",
    "_mb": "MB",
    "_m": "m",
    "_s": "s",
    "samples": "samples",
    "iterations": "iterations",
    "seconds": "s",
    "minutes": "min",
}


@dataclass(frozen=True)
class Field:
    """One setting."""

    name: str
    """Dotted, as on the command line: `world.carry.scale`."""
    kind: str
    default: str
    unit: str
    meaning: str
    positional: bool = False
    """Whether it is a word of its own, without a flag."""
    word: str = ""
    """What stands for a value in a help text: N, PATH, fast|paper; empty for a switch."""
    choices: tuple[str, ...] = ()
    """The valid values, where they are enumerated."""
    many: bool = False
    """Whether it takes any number of values."""
    bounds: str = ""
    """The bounds of a number, as in `1 to 100`."""
    needed: bool = False
    """Whether it must be given."""
    owner: type = object
    """The dataclass that it is a field of."""

    @property
    def own_name(self) -> str:
        """Its name in that dataclass."""
        return self.name.rpartition(".")[2]

    @property
    def flag(self) -> str:
        """How the command line spells it."""
        return self.name if self.positional else "--" + self.name.replace("_", "-")

    @property
    def typed(self) -> str:
        """The flag that changes the default: `--no-open` of a switch that is on."""
        if self.kind != "yes or no" or self.default != "yes":
            return self.flag
        group, dot, last = self.flag.removeprefix("--").rpartition(".")
        return f"--{group}{dot}no-{last}"


def docstrings(kind: type) -> dict[str, str]:
    """The docstring under each field of a dataclass, inherited ones too."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        if not dataclasses.is_dataclass(base):
            continue
        body = ast.parse(textwrap.dedent(inspect.getsource(base))).body[0]
        assert isinstance(body, ast.ClassDef)
        for here, below in zip(body.body, body.body[1:], strict=False):
            if (
                isinstance(here, ast.AnnAssign)
                and isinstance(here.target, ast.Name)
                and isinstance(below, ast.Expr)
                and isinstance(below.value, ast.Constant)
            ):
                found[here.target.id] = " ".join(str(below.value.value).split())
    return found


def walk(kind: type, value: Any = None, prefix: str = "") -> Iterator[Field]:
    """The fields of a dataclass, nested ones by dotted names; defaults are those of `value`."""
    docs = docstrings(kind)
    hints = typing.get_type_hints(kind, include_extras=True)
    for field in dataclasses.fields(kind):
        annotated = hints[field.name]
        bare, extra = _bare(annotated)
        default = getattr(value, field.name) if value is not None else _default(field)
        if dataclasses.is_dataclass(bare) and isinstance(bare, type):
            flat = any(getattr(e, "name", None) == "" for e in extra)
            inside = prefix if flat else f"{prefix}{field.name}."
            given = default if dataclasses.is_dataclass(default) else None
            yield from walk(bare, given, inside)
            continue
        if any("Fixed" in repr(e) for e in extra):
            continue  # set by the program
        meaning = docs.get(field.name, "")
        yield Field(
            prefix + field.name,
            shown_type(bare),
            shown_value(default),
            unit_of(field.name, meaning),
            meaning,
            any("Positional" in repr(e) for e in extra),
            next((e.metavar for e in extra if getattr(e, "metavar", None)), word_of(bare, meaning)),
            choices_of(bare),
            typing.get_origin(bare) is tuple,
            bounds.text(kind, field.name),
            _default(field) is dataclasses.MISSING,
            kind,
        )


def word_of(kind: Any, meaning: str = "") -> str:
    """What stands for a value of a type in a help text; empty for a switch.

    meaning: of the setting; it may name the form of a text, as in HOST:PORT.
    """
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        return word_of(next(a for a in arguments if a is not type(None)), meaning)
    if origin is typing.Literal:
        return "|".join(map(str, arguments))
    if origin is tuple:
        if arguments[-1] is Ellipsis:
            return f"{word_of(arguments[0], meaning)} ..."
        return " ".join(map(word_of, arguments))
    form = re.search(r"\b[A-Z]+([:,=][A-Z]+)+\b|\bNAME\b", meaning)
    text = form.group() if form else "TEXT"
    return {bool: "", int: "N", float: "X", Path: "PATH"}.get(kind, text)


def choices_of(kind: Any) -> tuple[str, ...]:
    """The values of a type that enumerates them; empty for others."""
    if typing.get_origin(kind) is typing.Literal:
        return tuple(map(str, typing.get_args(kind)))
    inner = typing.get_args(kind) if typing.get_origin(kind) else ()
    return next((found for one in inner if (found := choices_of(one))), ())


def unit_of(name: str, meaning: str) -> str:
    """The unit of a field: by the end of its name, else as its docstring ends (`..., m.`)."""
    for suffix, unit in SUFFIXES.items():
        if name.endswith(suffix):
            return unit
    stated = re.search(r", (m/s|m|rad|kg|s|Hz)(?=[.,:;]|$)", meaning)
    return stated.group(1) if stated else ""


def shown_type(kind: Any) -> str:
    """A type as a reader wants it: `float`, `sit or lie`, `float, float`, `float or none`."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if kind is type(None):
        return "none"
    if origin in (typing.Union, types.UnionType):
        return " or ".join(shown_type(a) for a in arguments)
    if origin is typing.Literal:
        return " or ".join(map(str, arguments))
    if origin is tuple:
        if arguments[-1] is Ellipsis:
            return f"{_in_list(arguments[0])} ..."
        return ", ".join(shown_type(a) for a in arguments)
    return {"Path": "path", "str": "text", "bool": "yes or no"}.get(
        getattr(kind, "__name__", str(kind)), getattr(kind, "__name__", str(kind))
    )


def shown_value(value: Any) -> str:
    """A default as one would type it; empty where there is none."""
    if value is dataclasses.MISSING:
        return ""
    if value is None or value == ():
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, tuple):
        return " ".join(
            f"({shown_value(v).replace(' ', ', ')})" if isinstance(v, tuple) else shown_value(v)
            for v in value
        )
    return str(value) or "none"


def _in_list(kind: Any) -> str:
    return f"({shown_type(kind)})" if typing.get_origin(kind) is tuple else shown_type(kind)


def _bare(annotated: Any) -> tuple[Any, tuple[Any, ...]]:
    if typing.get_origin(annotated) is typing.Annotated:
        bare, *extra = typing.get_args(annotated)
        return bare, tuple(extra)
    return annotated, ()


def _default(field: "dataclasses.Field[Any]") -> Any:
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default
