"""Tables of results, from the evaluations that the committed policies carry."""

import json
from pathlib import Path
from typing import Any

from console.evaluation.presets import published
from docs.generate.markdown import table

ROOT = Path(__file__).parents[2]
KINDS = ("", "-projectiles", "-moved")
FILES = (*(f"evaluation{kind}" for kind in KINDS), *(f"evaluation-imported{k}" for k in KINDS))


#: Policies that follow the package's own clips.
OWN_CLIPS = ("track-sit",)


def evaluations() -> list[tuple[str, dict[str, Any]]]:
    """(policy, figures) of every evaluation that a committed policy carries."""
    return [
        (folder.name, json.loads(file.read_text()))
        for folder in sorted((ROOT / "pretrained").iterdir())
        for file in (folder / f"{name}.json" for name in FILES)
        if file.exists()
    ]


def rows_of(policy: str) -> str:
    """The headline table of one policy."""
    return table(HEADS, (_row(name, figures) for name, figures in evaluations() if name == policy))


def page() -> str:
    """One table of all policies, then each policy by stage, distance and object."""
    found = evaluations()
    reached = [(name, figures) for name, figures in found if "success" in figures]
    parts = [INTRODUCTION, table(HEADS, (_row(name, figures) for name, figures in reached))]
    for name, figures in found:
        if "completed" in figures:
            parts += [f"## {name}\n", *_followed(name, figures)]
        elif figures.get("held_out") and figures["perturbation"] == "none":
            parts += [f"### {name}, imported pieces\n", _command(name, figures), _classes(figures)]
        elif figures["perturbation"] == "none" and not figures.get("held_out"):
            parts += [f"## {name}\n", _command(name, figures), *_breakdown(figures)]
    return "\n".join(parts)


INTRODUCTION = """# Committed policies

Each row is an evaluation of a committed policy (`pretrained/NAME/evaluation*.json`). Furniture is
of the test split, or imported meshes that no training of ours used; the policy takes the mean
action, and a trial lasts 20 s. [Evaluation](../how-to/evaluate.md) defines every figure; objects
are pieces of furniture, or size classes of boxes. Intervals are Wilson's, 95 %. The paper's initial
distances are 1-10 m: a row with other distances is not comparable with it.

The imported meshes are the [94 real pieces](furniture.md) of three libraries, `PIECES` in the
commands; a third of each class is held out by a [fixed
list](../how-to/furniture.md#hold-pieces-out-of-training).
"""
HEADS = (
    "policy",
    "disturbance",
    "start, m",
    "trials",
    "pieces",
    "objects",
    "success, %",
    "95 %",
    "sustained, %",
    "falls, %",
    "time, s",
    "error, cm",
    "published, %",
)


def _row(name: str, figures: dict[str, Any]) -> list[str]:
    low, high = figures["success"]["ci95"]
    paper = [
        f"{row.name} {row.success}"
        for row in published(figures["task"], figures["preset"], figures["perturbation"])
        if row.success is not None
    ]
    return [
        name,
        figures["perturbation"],
        "-".join(f"{x:g}" for x in figures["start_m"]),
        f"{figures['trials']:,}",
        "imported" if figures.get("held_out") else "test",
        str(len(figures["by_object"])),
        f"{100 * figures['success']['rate']:.1f}",
        f"{100 * low:.1f}-{100 * high:.1f}",
        f"{100 * figures['sustained']['rate']:.1f}",
        f"{100 * figures['falls']:.1f}",
        f"{figures['time_s']:.1f}",
        f"{100 * figures['precision_m']:.1f}",
        ", ".join(paper),
    ]


def _command(name: str, figures: dict[str, Any]) -> str:
    near, far = figures["start_m"]
    flags = "" if (near, far) == (1.0, 10.0) else f" --near-m {near:g} --far-m {far:g}"
    if figures.get("held_out"):
        flags += " --objects PIECES --held-out"
    return (
        f"```sh\ninhabit evaluate pretrained/{name} --trials {figures['trials']}"
        f" --seed {figures['seed']}{flags}\n```\n"
    )


def _classes(figures: dict[str, Any]) -> str:
    """The table by class, and the five worst pieces."""
    pieces = figures["by_object"]
    rows = (
        (
            row["class"],
            row["trials"],
            _percent(row["success"]),
            "-".join(map(_percent, row["ci95"])),
        )
        for row in figures["by_class"]
    )
    worst = sorted(pieces, key=lambda row: row["success"])[:5]
    names = ", ".join(f"{row['object']} {_percent(row['success'])} %" for row in worst)
    return table(("class", "trials", "success, %", "95 %"), rows) + f"\nThe worst: {names}.\n"


def _breakdown(figures: dict[str, Any]) -> list[str]:
    stages = (
        (p["stage"], _percent(p["rate"]), "-".join(_percent(x) for x in p["ci95"]))
        for p in figures["by_stage"]
    )
    distances = (
        (f"{p['from_m']:g}-{p['to_m']:g}", p["trials"], _percent(p["success"]))
        for p in figures["by_distance"]
    )
    objects = ((p["object"], p["trials"], _percent(p["success"])) for p in figures["by_object"])
    return [
        table(("stage", "reached, %", "95 %"), stages),
        table(("start, m", "trials", "success, %"), distances),
        table(("object", "trials", "success, %"), objects),
    ]


def _followed(name: str, figures: dict[str, Any]) -> list[str]:
    """The table of a policy that follows clips, by clip."""
    own = name in OWN_CLIPS
    command = (
        f"```sh\ninhabit evaluate pretrained/{name}{'' if own else ' --motions CLIPS'}"
        f" --trials {figures['trials']} --seed {figures['seed']}\n```\n"
    )
    whose = " of the package" if own else ", which are not part of the package"
    rows = [{"clip": "all", **figures}, *figures["by_clip"]]
    heads = ("clip", "trials", "completed, %", "95 %", "whole, %", "body, cm", "object, cm",
             "contact F1")  # fmt: skip
    return [
        f"It follows [clips](../how-to/track.md){whose}: share of the"
        " trials that reach the clip's end, from any sound frame and from the first; mean"
        " deviations until then, and how well the hands' contacts agree.\n",
        command,
        table(
            heads,
            (
                (
                    row["clip"],
                    f"{row['trials']:,}",
                    _percent(row["completed"]["rate"]),
                    "-".join(_percent(x) for x in row["completed"]["ci95"]),
                    _percent(row["completed_whole"]["rate"]),
                    f"{row['body_cm']:.1f}",
                    "" if row["object_cm"] is None else f"{row['object_cm']:.1f}",
                    "" if row["contact_f1"] is None else f"{row['contact_f1']:.3f}",
                )
                for row in rows
            ),
        ),
    ]


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100 * share:.1f}"
