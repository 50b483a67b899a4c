"""The sections of the help name what there is, and every flag that scripts of others stand on."""

import pytest

from console import commands
from console.manual import page
from console.manual.sections import COMMANDS, FLAGS

ENTRIES = [*commands.COMMANDS, *(entry for group in commands.GROUPS for entry in group.entries)]


def test_every_command_is_in_one_section() -> None:
    told = [name for section in COMMANDS for name in section.names]
    assert sorted(told) == sorted(e.name for e in (*commands.COMMANDS, *commands.GROUPS))


@pytest.mark.parametrize("kind", FLAGS, ids=lambda kind: kind.__name__)
def test_sections_name_flags_that_there_are_once(kind: type) -> None:
    told = [name for section in FLAGS[kind] for name in section.names]
    typed = {f.typed.removeprefix("--") for f in page.flags_of(kind)}
    assert set(told) <= typed and len(told) == len(set(told))
    assert kind in {entry.flags for entry in ENTRIES}


#: The flags that the contract of the command line names.
CONTRACT: dict[type, str] = {
    commands.Train: "mix recipe run samples iterations seed scenes threads runner actors address"
    " device simulator motions objects init dry-run resume restart",
    commands.Evaluate: "trials objects perturb seed threads json",
    commands.Synthesize: "object start out",
    commands.Serve: "listen tls-cert tls-key token-file metrics",
    commands.Style: "listen tls-cert tls-key token-file metrics",
    commands.Bench: "json",
    commands.Realism: "against json",
    commands.Plan: "actors scenes",
}


@pytest.mark.parametrize("kind", CONTRACT, ids=lambda kind: kind.__name__)
def test_the_flags_of_the_contract_are_shown_first(kind: type) -> None:
    told = {name for section in FLAGS[kind] for name in section.names}
    assert set(CONTRACT[kind].split()) <= told


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.flags.__name__)
def test_a_needed_flag_is_shown_first(entry: commands.Entry) -> None:
    needed = {f.typed for f in page.flags_of(entry.flags) if f.needed and not f.positional}
    assert all(flag in page.command(entry.name, entry.flags) for flag in needed)
