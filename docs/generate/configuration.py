"""The page of an experiment's settings."""

from console.run.experiment import PRESETS, Experiment
from docs.generate import fields
from docs.generate.markdown import code, table

SECTIONS = (
    ("", "The experiment"),
    ("world.", "world: scenes, furniture, clips and initial states"),
    ("ppo.", "ppo: policy, value function and their training"),
    ("style.", "style: the discriminator"),
)


def page() -> str:
    """Every field with unit, default, and where a preset differs from it."""
    plain = list(fields.walk(Experiment, Experiment()))
    presets = {
        name: {f.name: f.default for f in fields.walk(Experiment, preset)}
        for name, preset in PRESETS.items()
    }
    parts = [
        "# Configuration\n",
        "An experiment is one tree of frozen dataclasses; `config.json` of a run holds it, and each"
        " field is a flag of `inhabit train`: `world.near_m` is `--world.near-m 0.75 1.6`."
        " A schedule is a list of (samples, value) points, linear between them. The columns of the"
        " presets are empty where a preset keeps the default.\n",
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
            rows.append((code(f.name), code(f.kind), code(f.default), *differs, f.unit, f.meaning))
        heads = ("field", "type", "default", *presets, "unit", "meaning")
        parts += [f"## {title}\n", table(heads, rows)]
    return "\n".join(parts)
