"""The gallery: replays of trials from fixed seeds, which can be turned.

`python -m docs.generate.gallery` simulates the trials with the committed policies and writes
docs/gallery/: one HTML file for each entry, and entries.json with what was measured. The viewer and
the style are those of reports; the site adds them once, beside the replays. A policy that follows
clips is shown on those of `--motions`; without them its entries stay as they are.
"""

import argparse
import json
import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from console.commands import Evaluate
from console.evaluation import tracking, trials
from console.evaluation.command import check, manifest_of, objects_of
from console.evaluation.scores import Outcomes, Protocol, judge
from console.evaluation.stepping import Track, Trials
from console.recording.format import Take
from console.report import followed as follow
from console.report.command import described, order
from console.report.page import document, player
from console.report.scene3d import body_poses, drawn
from console.run import assembly, machine
from console.run.directory import write_text
from docs.generate.markdown import table
from world import tasks
from world.errors import ConfigError
from world.furniture.piece import Piece
from world.meshes import importing
from world.meshes.build import ImportOptions
from world.meshes.frame import Frame

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "gallery"
#: What the site serves beside the replays.
SHARED = ("page.css", "viewer.js")
#: Trials that an entry chooses from, and their seed.
TRIALS, SEED = 64, 25
#: A replay ends this many control steps after its success; one without success is no longer than
#: the second.
_AFTER, _FAILURE = 60, 360
#: Most bytes of one file, and of all.
MOST, MOST_OF_ALL = 300_000, 6_000_000


@dataclass(frozen=True)
class Run:
    """Trials of an entry, with their outcomes."""

    chosen: Trials
    results: trials.Results
    outcomes: Outcomes

    def ranked(self) -> list[int]:
        """Trials from best to worst, as in a report."""
        return order(self.outcomes, self.results.error_m)

    def good(self) -> list[int]:
        """Trials whose success is sustained, from best to worst."""
        return [trial for trial in self.ranked() if self.outcomes.sustained[trial]]


Choice = Callable[[Run], dict[str, int]]
"""Trials of a run by the name of their button; without those that no trial is fit for."""


def typical(run: Run) -> dict[str, int]:
    """The best trial, the median one and the worst."""
    ranked = run.ranked()
    return {"best": ranked[0], "median": ranked[len(ranked) // 2], "worst": ranked[-1]}


def recoveries(run: Run) -> dict[str, int]:
    """The successes under most balls, and the first failure."""
    thrown = run.results.disturbed
    found = sorted(run.good(), key=lambda trial: -int(thrown[trial]))[:2]
    bad = [trial for trial in run.ranked() if not run.outcomes.success[trial]][:1]
    chosen = dict(zip(("recovers", "recovers, another"), found, strict=False))
    chosen.update(zip(("fails",), bad, strict=False))
    return chosen


def followed(run: Run) -> dict[str, int]:
    """Successes after a move of the furniture, and the worst trial."""
    found = [trial for trial in run.good() if run.results.disturbed[trial]]
    middle = found[len(found) // 2 :][:1]
    return dict(zip(("follows",), middle, strict=False)) | {"worst": run.ranked()[-1]}


def spread(run: Run) -> dict[str, int]:
    """Successes on the lowest, the highest and the widest piece."""
    found = run.good()
    if not found:
        return {}
    size = {t: np.array(run.chosen.pieces[t].size_m) * run.chosen.scale[t] for t in found}
    height = {t: _seat_m(run.chosen.pieces[t]) * run.chosen.scale[t] for t in found}
    return {
        "lowest": min(found, key=lambda t: height[t]),
        "highest": max(found, key=lambda t: height[t]),
        "widest": max(found, key=lambda t: size[t][1]),
    }


def one(run: Run) -> dict[str, int]:
    """The median success."""
    found = run.good()
    return {"sits": found[len(found) // 2]} if found else {}


def _seat_m(piece: Piece) -> float:
    return piece.sit[0].point_m[2] if piece.sit else float(piece.bounds()[1][2])


@dataclass(frozen=True)
class Entry:
    """One replay of the gallery."""

    name: str
    """Name of its file."""
    title: str
    policy: str
    """Name of a committed policy."""
    choice: Choice
    perturb: str = "none"
    near_m: float = 1.0
    far_m: float = 10.0
    mesh: bool = False
    """Whether the furniture is the imported mesh of this file."""


ENTRIES = (
    Entry("sit", "Sit", "sit-free", typical),
    Entry("lie", "Lie", "lie-free", typical),
    Entry("carry", "Carry", "carry", typical),
    Entry("walk", "Walk", "walk", typical),
    Entry("sit-projectiles", "Sit, hit by balls of 1.2 kg", "sit-free", recoveries, "projectiles"),
    Entry("walk-projectiles", "Walk, hit by balls", "walk", recoveries, "projectiles"),
    Entry("sit-moved", "Sit, on furniture that moves away", "sit-free", followed, "moved"),
    Entry("lie-moved", "Lie, on furniture that moves away", "lie-free", followed, "moved"),
    Entry("sit-spread", "Seats: the widest spread", "sit-free", spread),
    Entry("lie-spread", "Beds, sofas and tables: the widest spread", "lie-free", spread),
    Entry("sit-mesh", "A chair from a mesh", "sit-free", one, mesh=True),
)


@dataclass(frozen=True)
class Followed:
    """Replays of a policy that follows clips, from any of their frames, beside the reference."""

    name: str
    """Name of its file."""
    title: str
    policy: str
    """Name of a committed policy."""


FOLLOWED = (
    Followed("track", "Follow clips with a box", "track"),
    Followed("track-sit", "Follow clips of sitting down", "track-sit"),
)


def longest(takes: Sequence[Take]) -> dict[str, int]:
    """The longest two completed trials of different clips, and the worst trial."""
    best: dict[str, int] = {}
    for trial, take in enumerate(takes):
        name = str(take.meta["clip"])
        longer = name not in best or len(take) > len(takes[best[name]])
        if take.meta["completed"] and longer:
            best[name] = trial
    found = sorted(best.values(), key=lambda trial: -len(takes[trial]))
    chosen: dict[str, int] = {}
    chosen.update(zip(("longest", "longest of another clip"), found, strict=False))
    return chosen | {"worst": follow.order(takes)[-1]}


def tub_chair() -> trimesh.Trimesh:
    """A chair with a round back, in metres, z up, front +x: what an imported mesh looks like. Files
    of meshes by others are not part of the project."""
    seat = trimesh.creation.cylinder(radius=0.26, height=0.06, sections=32)
    parts = [seat.apply_translation((0.0, 0.0, 0.42))]
    for angle in np.radians([45.0, 135.0, 225.0, 315.0]):
        leg = trimesh.creation.cylinder(radius=0.02, height=0.40, sections=12)
        parts.append(leg.apply_translation((0.2 * math.cos(angle), 0.2 * math.sin(angle), 0.20)))
    for angle in np.radians(np.arange(110.0, 251.0, 10.0)):
        slat = trimesh.creation.box((0.03, 0.05, 0.34))
        slat.apply_transform(trimesh.transformations.rotation_matrix(angle, (0, 0, 1)))
        slat.apply_translation((0.26 * math.cos(angle), 0.26 * math.sin(angle), 0.60))
        parts.append(slat)
    whole = trimesh.util.concatenate(parts)
    assert isinstance(whole, trimesh.Trimesh)
    return whole


def imported() -> Piece:
    """The chair, through the same import as any mesh."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tub-chair.stl"
        tub_chair().export(path)
        (outcome,) = importing.run(importing.jobs([path], ImportOptions(Frame(up="+z"))), 1)
    piece = outcome.piece()
    assert piece is not None, outcome.refused
    return piece


def simulated(entry: Entry, found: assembly.Trained) -> Run:
    """The trials of an entry."""
    task = tasks.make(found.task)
    command = check(
        Evaluate(
            found.path,
            trials=TRIALS,
            perturb=entry.perturb,  # pyright: ignore[reportArgumentType]
            near_m=entry.near_m,
            far_m=entry.far_m,
            seed=SEED,
            quality=0,
        ),
        found.task,
    )
    protocol = Protocol(success_m=task.success_m, limit_s=task.evaluation.limit_s)
    pieces = (imported(),) if entry.mesh else objects_of(found, "test", TRIALS, SEED)
    world = found.experiment.world
    chosen = manifest_of(found.task, pieces, command, protocol, world.scale)
    results = trials.run(
        world, found.weights, chosen, protocol.steps, machine.cores(), record=TRIALS
    )
    return Run(chosen, results, judge(results.error_m, results.fell_at, protocol))


def replay(track: Track, about: str, success_m: float, every: int = 1) -> dict[str, Any]:
    """Data of the viewer of a trial, until shortly after its success or its fall; every: control
    steps of a frame."""
    step = track.take.meta["success_at_step"]
    fell = track.take.meta["fell_at_step"]
    frames = len(track.take)
    if fell is None:
        frames = min(frames, _FAILURE if step is None else step + _AFTER)
    data = drawn(
        track.model,
        body_poses(track)[:frames:every],
        track.error_m[:frames:every],
        min(track.steps, frames) // every,
        track.take.piece,
    )
    data["hz"] /= every
    return data | {"about": about, "success_m": success_m, "fell": fell is not None}


def written(entry: Entry) -> tuple[str, dict[str, Any]]:
    """The HTML of an entry, and what was measured."""
    found = assembly.trained(ROOT / "pretrained" / entry.policy)
    run = simulated(entry, found)
    chosen = entry.choice(run)
    about = {name: described(run.results.tracks[i], run.outcomes, i) for name, i in chosen.items()}
    success_m = tasks.make(found.task).success_m

    def content(every: int) -> str:
        takes = [
            replay(run.results.tracks[i], about[name], success_m, every)
            for name, i in chosen.items()
        ]
        return document(entry.title, [player(list(chosen))], takes, linked=True)

    facts = {
        "title": entry.title,
        "policy": entry.policy,
        "perturb": entry.perturb,
        "start_m": [entry.near_m, entry.far_m],
        "trials": TRIALS,
        "seed": SEED,
        "success": int(run.outcomes.success.sum()),
        "falls": int(run.outcomes.fell.sum()),
        "iteration": found.manifest.iteration,
        "shown": about,
    }
    return small(entry.name, content), facts


def following(entry: Followed, motions: Sequence[str]) -> tuple[str, dict[str, Any]]:
    """The HTML of an entry that follows these clips, and what was measured."""
    found = assembly.trained(ROOT / "pretrained" / entry.policy)
    figures, takes = tracking.evaluate(found, tuple(motions), TRIALS, SEED, machine.cores(), TRIALS)
    chosen = longest(takes)

    def content(every: int) -> str:
        shown = [follow.replay(takes[trial], every) for trial in chosen.values()]
        return document(entry.title, [player(list(chosen), follows=True)], shown, linked=True)

    facts = {
        "title": entry.title,
        "policy": entry.policy,
        "trials": TRIALS,
        "seed": SEED,
        "completed": sum(bool(take.meta["completed"]) for take in takes),
        "body_cm": round(figures["body_cm"], 1),
        "iteration": found.manifest.iteration,
        "shown": {name: follow.described(takes[trial]) for name, trial in chosen.items()},
    }
    return small(entry.name, content), facts


def small(name: str, content: Callable[[int], str]) -> str:
    """The page of every, every second or every third control step: the first that is small."""
    size = 0
    for every in (1, 2, 3):
        text = content(every)
        size = len(text)
        if size <= MOST:
            return text
    raise AssertionError(f"{name}: {size} bytes; show fewer trials")


def make(names: Sequence[str], motions: Sequence[str]) -> None:
    """Write the entries of these names, by default all; motions: clips to follow."""
    every = (*ENTRIES, *FOLLOWED)
    known = {entry.name for entry in every}
    if unknown := sorted(set(names) - known):
        raise ConfigError(
            f"{', '.join(unknown)}: no such entry; there are {', '.join(sorted(known))}"
        )
    file = FOLDER / "entries.json"
    facts: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}
    for entry in every:
        if names and entry.name not in names:
            continue
        if isinstance(entry, Entry):
            text, facts[entry.name] = written(entry)
        elif motions:
            text, facts[entry.name] = following(entry, motions)
        else:
            print(f"{entry.name}: left as it is; --motions names the clips to follow")
            continue
        write_text(FOLDER / f"{entry.name}.html", text)
        kept = {entry.name: facts[entry.name] for entry in every if entry.name in facts}
        write_text(file, json.dumps(kept, indent=1) + "\n")
        fact = facts[entry.name]
        good = fact["success"] if isinstance(entry, Entry) else fact["completed"]
        print(f"{entry.name}: {len(text) / 1e3:.0f} kB, {good} of {TRIALS}")


def page() -> str:
    """Markdown of the gallery."""
    facts = json.loads((FOLDER / "entries.json").read_text())
    rows = [
        (
            f"[{fact['title']}](#{name})",
            fact["policy"],
            f"{fact['start_m'][0]:g}-{fact['start_m'][1]:g}",
            fact["perturb"],
            f"{fact['success']} of {fact['trials']}",
            str(fact["falls"]),
        )
        for name, fact in facts.items()
        if "success" in fact
    ]
    heads = ("", "policy", "start, m", "disturbance", "success", "falls")
    tracked = [
        (
            f"[{fact['title']}](#{name})",
            fact["policy"],
            f"{fact['completed']} of {fact['trials']}",
            f"{fact['body_cm']:.1f}",
        )
        for name, fact in facts.items()
        if "completed" in fact
    ]
    follows = table(("", "policy", "completed, from any frame", "bodies, cm"), tracked)
    parts = [INTRODUCTION, table(heads, rows), follows]
    for name, fact in facts.items():
        shown = "; ".join(f"*{button}*: {text}" for button, text in fact["shown"].items())
        parts.append(f"## {fact['title']} {{#{name}}}\n\n{shown}.\n")
        parts.append(
            f'<iframe src="{name}.html" title="{escape(fact["title"])}" loading="lazy" '
            'height="660" style="width: 100%; border: 0"></iframe>\n'
        )
    return "\n".join(parts)


INTRODUCTION = f"""# Gallery

Replays of trials with the committed policies: drag to turn, scroll to zoom. Each entry chooses from
{TRIALS} trials of one seed ({SEED}), worst cases too; these few trials show what happens, the
[results](../results/policies.md) say how often. `python -m docs.generate.gallery` makes the page
again when a policy changes. The chair from a mesh is made in code and imported like any other:
meshes by others are not part of the project. The translucent character of a policy that follows
clips is the reference; `--motions` names the clips to make those entries again.
"""

if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m docs.generate.gallery")
    parser.add_argument("names", nargs="*", help="entries; default: all")
    parser.add_argument("--motions", nargs="*", default=[], help="clips to follow")
    given = parser.parse_args()
    try:
        make(given.names, given.motions)
    except ConfigError as error:
        parser.error(str(error))
