"""Parts of written pages that follow from committed policies: `<!-- command: sit -->`, ...

Text behind a mark on its line is shown only where the page is read unbuilt, as on GitHub.
"""

import re
from collections.abc import Callable
from pathlib import Path

from console.manual import fields
from console.run import assembly
from console.run.experiment import PRESETS, Experiment
from docs.generate import results
from docs.generate.markdown import code, table
from policy.checkpoints.format import read_manifest

ROOT = Path(__file__).parents[2]
MARK = re.compile(r"<!-- (\w+): ([\w-]+) -->[^\n]*")
#: Settings that say nothing about learning, or that a command states otherwise.
LEFT_OUT = ("seed", "world.task")


def settings(name: str) -> str:
    """Fields of a policy's experiment that differ from the defaults."""
    rows = ((code(f.name), code(f.default), f.unit, f.meaning) for f in changed(name, Experiment()))
    return table(("field", "value", "unit", "meaning"), rows)


def command(name: str) -> str:
    """The training command of a policy's last run, over the preset `fast`."""
    words = [f"inhabit train {name} --motions CLIPS --init BEFORE"]
    words += [_flag(f) for f in changed(name, PRESETS["fast"])]
    return "```sh\n" + " \\\n    ".join(words) + "\n```"


def _flag(field: fields.Field) -> str:
    """A setting as it is typed: schedules and ranges as plain numbers."""
    if field.kind == "yes or no":
        room, _, last = field.flag.rpartition(".")
        no = f"{room}.no-{last}" if room else field.flag.replace("--", "--no-")
        return field.flag if field.default == "yes" else no
    return f"{field.flag} {re.sub('[(),]', '', field.default)}"


def result(name: str) -> str:
    """The headline of a policy's evaluations."""
    return results.rows_of(name)


SNIPPETS: dict[str, Callable[[str], str]] = {
    "settings": settings,
    "command": command,
    "result": result,
}


def changed(name: str, base: Experiment) -> list[fields.Field]:
    """Fields of the experiment of `pretrained/NAME` that differ from `base`."""
    folder = ROOT / "pretrained" / name
    experiment = assembly.experiment_of(read_manifest(folder), folder)
    before = {f.name: f.default for f in fields.walk(Experiment, base)}
    return [
        f
        for f in fields.walk(Experiment, experiment)
        if f.default != before[f.name] and f.name not in LEFT_OUT
    ]


def filled(text: str) -> str:
    """A page with its snippets."""
    return MARK.sub(lambda found: SNIPPETS[found[1]](found[2]), text)
