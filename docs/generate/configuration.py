"""The page of an experiment's settings."""

from console.manual import fields
from console.run.experiment import PRESETS, Experiment
from console.run.renamed import REPEATED
from docs.generate.markdown import code, table

SECTIONS = (
    ("", "The experiment"),
    ("world.", "world: scenes, furniture, clips and initial states"),
    ("ppo.", "ppo: policy, value function and their training"),
    ("style.", "style: the discriminator"),
)


def page() -> str:
    """Page of every field with its unit, its default, and the presets that differ from it."""
    plain = list(fields.walk(Experiment, Experiment()))
    presets = {
        name: {f.name: f.default for f in fields.walk(Experiment, preset)}
        for name, preset in PRESETS.items()
    }
    parts = [
        "# Configuration\n",
        "An experiment is one tree of frozen dataclasses; `config.json` of a run holds it, and each"
        " field is a flag of `inhabit train`: `world.initial.near_m` is"
        " `--world.initial.near-m 0.75 1.6`. Other flags set "
        + ", ".join(f"`{key}` ({flag})" for key, flag in REPEATED.items())
        + ". A schedule is a list of (samples, value) points,"
        " linear between them. The column of a preset is empty where the preset has the default.\n",
    ]
    for prefix, title in SECTIONS:
        rows = []
        for f in plain:
            section = next((p for p, _ in SECTIONS[1:] if f.name.startswith(p)), "")
            if section != prefix:
                continue
            differs = [
                code(values[f.name]) if values[f.name] != f.default else ""
                for values in presets.values()
            ]
            rows.append((code(f.name), f.meaning, code(f.default), *differs, code(f.kind), f.unit))
        heads = ("field", "meaning", "default", *presets, "type", "unit")
        parts += [f"## {title}\n", table(heads, rows)]
    return "\n".join(parts)
