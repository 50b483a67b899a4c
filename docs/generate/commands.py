"""The page of commands and their flags."""

from console import commands
from console.manual import fields
from console.run.experiment import Experiment
from docs.generate.markdown import code, table

GROUPS = (
    ("", commands.COMMANDS),
    ("motions ", commands.MOTIONS),
    ("objects ", commands.OBJECTS),
)


def page() -> str:
    """Every command with its flags."""
    settings = {f.name for f in fields.walk(Experiment)}
    train = next(entry for entry in commands.COMMANDS if entry.name == "train")
    parts = [
        "# Commands\n",
        "`inhabit COMMAND --help` shows the flags that are wanted first, `--help-all` all of them."
        " Exit codes are 0 (success), 1"
        " (failure), 2 (invalid arguments) and 130 (interrupted). An error is one line; `--debug`"
        " adds the traceback. A file that is written replaces an existing one only where that is of"
        " the same kind: an evaluation, a page, a film.\n",
    ]
    for group, entries in GROUPS:
        for entry in entries:
            found = list(fields.walk(entry.flags))
            shown = entry is not train
            own = [
                f
                for f in found
                if f.name not in settings or (shown and not f.name.startswith("world."))
            ]
            words = [f.name.upper() for f in own if f.positional]
            parts.append(f"## inhabit {group}{entry.name}\n")
            parts.append((entry.flags.__doc__ or "").strip() + "\n")
            parts.append(f"```sh\n{' '.join(['inhabit', group + entry.name, *words])}\n```\n")
            rows = [(code(f.flag), f.meaning, code(f.default), code(f.kind), f.unit) for f in own]
            parts.append(table(("flag", "meaning", "default", "type", "unit"), rows))
            if len(found) > len(own):
                which = "every field" if entry is train else "every field of `world`"
                parts.append(
                    f"In addition, {which} of [the configuration](configuration.md) is a flag.\n"
                )
    return "\n".join(parts)
