"""What a setting's field tells of the flag: its name as typed, its values and its bounds."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from console import commands
from console.manual import fields
from console.manual.fields import choices_of, word_of


@dataclass(frozen=True)
class Inner:
    """A nested group."""

    gamma: float = 0.5
    """Discount."""


@dataclass(frozen=True)
class Outer:
    """Flags of a made-up command."""

    source: Path
    """What is read."""
    listen: str = "a:1"
    """HOST:PORT of the page."""
    open: bool = True
    """Open it."""
    inner: Inner = Inner()


def test_fields_of_nested_dataclasses_become_dotted_flags() -> None:
    source, listen, opens, gamma = fields.walk(Outer)
    assert (source.flag, source.word, source.needed) == ("--source", "PATH", True)
    assert (listen.word, listen.default, listen.needed) == ("HOST:PORT", "a:1", False)
    assert (opens.flag, opens.typed, opens.word) == ("--open", "--no-open", "")
    assert (gamma.flag, gamma.own_name, gamma.owner) == ("--inner.gamma", "gamma", Inner)


def test_words_and_choices_follow_the_type() -> None:
    assert word_of(int | None) == "N" and word_of(tuple[float, float]) == "X X"
    assert word_of(tuple[str, ...], "shares, TASK=SHARE each") == "TASK=SHARE ..."
    assert word_of(str, "a NAME of the package") == "NAME" and word_of(str) == "TEXT"
    assert choices_of(Literal["m", "cm"] | None) == ("m", "cm")  # pyright: ignore
    assert choices_of(str) == choices_of(tuple[int, ...]) == ()


def test_a_switch_of_a_group_is_turned_off_behind_its_dot() -> None:
    found = {f.name: f for f in fields.walk(commands.Train)}
    assert found["world.mirror"].typed == "--world.no-mirror"
    assert found["resume"].typed == "--resume" and "overrides" not in found
    assert found["threads"].bounds == "1 to 1024"
