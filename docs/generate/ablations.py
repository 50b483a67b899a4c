"""The ablations: which trainings, what came of them, and their page.

`python -m docs.generate.ablations RUNS` trains what docs/results/ablations.json lacks, evaluates
it, measures its realism and adds it there; a call that is stopped goes on where it was.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import mean
from typing import Any

from console.evaluation.scores import wilson
from console.run.directory import write_json
from docs.generate.markdown import code, table

FILE = Path(__file__).parents[1] / "results" / "ablations.json"
SAMPLES = 5_000_000
#: What all trainings begin from, in the folder of the runs, and what they are.
TAUGHT = "taught"
TEACHERS = ("--world.walker", "walk", "--world.tracker", "track-sit")
DISTILL = ("distill", "sit", TAUGHT, "--init", "walk", *TEACHERS, "--minutes", "5")
HOW = ("train", "sit", "--preset", "finetune", "--samples", str(SAMPLES))
TRAIN = (*HOW, "--init", TAUGHT)
#: Trials of an evaluation and of the measure of realism, and their seed: one for development.
TRIALS, MOTIONS, SEED = 1024, 128, 100
ALL = "all parts"


@dataclass(frozen=True)
class Row:
    """One setting."""

    name: str
    flags: tuple[str, ...]
    seeds: int


PAPER = (
    Row(ALL, (), 3),
    Row("character-only discriminator", ("--style.no-object-features",), 2),
    Row("350 training pieces", ("--world.pieces", "350"), 2),
    Row("35 training pieces", ("--world.pieces", "35"), 2),
    Row("7 training pieces", ("--world.pieces", "7"), 2),
    Row("no reference state initialisation", ("--world.initial.reference", "0"), 2),
    Row("no size randomisation", ("--world.scale", "1", "1", "--world.scales", "1"), 2),
)
STYLE = (
    Row("10 states in a window", ("--style.window", "10"), 3),
    Row("no throttle", ("--style.throttle", "1"), 3),
    Row("10 states, no throttle", ("--style.window", "10", "--style.throttle", "1"), 3),
)
ROWS = (*PAPER, *STYLE)


@dataclass(frozen=True)
class Trained:
    """What came of one training."""

    row: str
    seed: int
    trials: int
    succeeded: int
    fell: float
    jerk: float | None
    """Ratio to the held-out clips in the approach, as the next one."""
    skating: float | None
    separability: float | None
    right_on_policy: float | None
    """Accuracy of the discriminator on the policy's transitions in the last iteration."""
    skipped: float | None
    """Share of the discriminator's trainings that the throttle skipped."""


def kept(file: Path) -> list[Trained]:
    """The trainings of a file; none where there is no file."""
    return [Trained(**one) for one in json.loads(file.read_text())] if file.exists() else []


def missing(found: Sequence[Trained]) -> list[tuple[Row, int]]:
    """(row, seed) of what is not trained yet: first all rows with the first seed."""
    there = {(one.row, one.seed) for one in found}
    return [
        (row, seed)
        for seed in range(max(row.seeds for row in ROWS))
        for row in ROWS
        if seed < row.seeds and (row.name, seed) not in there
    ]


def train(row: Row, seed: int, folder: Path, inhabit: Callable[..., None]) -> Trained:
    """Train, evaluate and measure one row with one seed; `inhabit` runs the command with these
    arguments."""
    run = folder / f"{ROWS.index(row)}-{seed}"
    evaluated, measured = run / "ablation.json", run / "realism.json"
    begun = ("--resume",) if (run / "config.json").exists() else ("--init", str(folder / TAUGHT))
    inhabit(*HOW, "--run", str(run), "--seed", str(seed), *row.flags, *begun)
    trials = ("--trials", str(TRIALS), "--seed", str(SEED))
    inhabit("evaluate", str(run), *trials, "--json", str(evaluated))
    motions = ("--trials", str(MOTIONS), "--seed", str(SEED))
    inhabit("realism", str(run), *motions, "--json", str(measured))
    lines = (run / "metrics.jsonl").read_text().splitlines()
    return trained(
        row,
        seed,
        json.loads(evaluated.read_text()),
        json.loads(measured.read_text()),
        [json.loads(line) for line in lines],
    )


def teach(folder: Path, inhabit: Callable[..., None]) -> None:
    """Distill what all trainings begin from, unless it is there."""
    out = folder / TAUGHT
    if not (out / "manifest.json").exists():
        inhabit(*(str(out) if word == TAUGHT else word for word in DISTILL))


def trained(
    row: Row,
    seed: int,
    evaluation: Mapping[str, Any],
    realism: Mapping[str, Any],
    metrics: Sequence[Mapping[str, Any]],
) -> Trained:
    """What the files of a run say."""
    approach = realism["phases"]["approach"]["values"]
    skips = [line["style/skipped"] for line in metrics if "style/skipped" in line]
    right = [line["style/accuracy_policy"] for line in metrics if "style/accuracy_policy" in line]
    return Trained(
        row.name,
        seed,
        evaluation["trials"],
        round(evaluation["success"]["rate"] * evaluation["trials"]),
        evaluation["falls"],
        approach["jerk"]["ratio"],
        approach["skating"]["ratio"],
        approach["separability"]["motion"],
        right[-1] if right else None,
        mean(skips) if skips else None,
    )


def page() -> str:
    """The page of the committed trainings."""
    return rendered(kept(FILE))


def rendered(found: Sequence[Trained]) -> str:
    """The page of these trainings, complete or not."""
    if not found:
        return _introduction() + "\nNone is measured yet.\n"
    left = missing(found)
    still = f"\n{len(left)} of {len(left) + len(found)} trainings are not measured yet.\n"
    return "\n".join(
        [
            _introduction(),
            still if left else "",
            "## Parts of the method\n",
            _table(PAPER, found),
            "## The style signal\n",
            "Beside the first row above, which has a window of 2 states, as the paper, and skips"
            " trainings of the discriminator while it is right on more than 90 %.\n",
            _table(STYLE, found),
            METHOD,
        ]
    )


INTRODUCTION = """# Ablations

What the parts of the method are worth, at equal samples: sit, from one policy that was distilled
from the shipped walker and tracker, on the package's own motions. A row is made by the last three
of these commands, with its flags:

```sh
inhabit DISTILL
inhabit TRAIN --run RUN --seed SEED FLAGS
inhabit evaluate RUN --trials 1024 --seed 100
inhabit realism RUN --trials 128 --seed 100
```

`python -m docs.generate.ablations runs/ablations` makes them all, two and three seeds each. A call
that is stopped goes on where it was.
"""


def _introduction() -> str:
    text = INTRODUCTION.replace("TRAIN", " ".join(TRAIN))
    return text.replace("DISTILL", " ".join(DISTILL))


METHOD = """
- Success is by the default protocol, 1-10 m, on unseen furniture, without noise: of all seeds, with
  Wilson's interval of all trials; it does not contain the spread between seeds. *By seed* does.
- Jerk and skating are ratios to held-out clips in the approach, separability is the area under the
  curve of a classifier of motion against clips ([realism](../how-to/realism.md)); means of the
  seeds.
- *Right on policy* is the share of the policy's transitions that the discriminator tells from
  mocap in the last iteration; *skipped*, the share of its trainings that the throttle skipped.
- The first row has 60 training pieces, each at six sizes from 0.8 to 1.2. Without reference states
  the near and far states keep their ratio.
- After so few samples policies still learn: a row says how fast, not how far. What is distilled
  sits down already, so a row says nothing of learning that from nothing.
"""
HEADS = (
    "row",
    "flags",
    "success, %",
    "95 %",
    "by seed",
    "falls, %",
    "jerk",
    "skating",
    "separability",
    "right on policy, %",
    "skipped, %",
)


def _table(rows: Sequence[Row], found: Sequence[Trained]) -> str:
    return table(
        HEADS, (_cells(row, [one for one in found if one.row == row.name]) for row in rows)
    )


def _cells(row: Row, seeds: Sequence[Trained]) -> tuple[str, ...]:
    head = (row.name, code(" ".join(row.flags)))
    if not seeds:
        return (*head, *[""] * (len(HEADS) - len(head)))
    trials = sum(one.trials for one in seeds)
    succeeded = sum(one.succeeded for one in seeds)
    low, high = wilson(succeeded, trials)
    return (
        *head,
        f"{100 * succeeded / trials:.1f}",
        f"{100 * low:.1f}-{100 * high:.1f}",
        ", ".join(f"{100 * one.succeeded / one.trials:.1f}" for one in seeds),
        f"{100 * mean(one.fell for one in seeds):.1f}",
        _mean([one.jerk for one in seeds], "{:.2f}"),
        _mean([one.skating for one in seeds], "{:.2f}"),
        _mean([one.separability for one in seeds], "{:.2f}"),
        _mean([one.right_on_policy for one in seeds], "{:.0f}", 100.0),
        _mean([one.skipped for one in seeds], "{:.0f}", 100.0),
    )


def _mean(values: Sequence[float | None], form: str, factor: float = 1.0) -> str:
    """The mean of what was measured; nothing where nothing was."""
    there = [value for value in values if value is not None]
    return form.format(factor * mean(there)) if there else ""


def main(arguments: Sequence[str] | None = None) -> None:
    """Train what the file lacks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", type=Path, help="folder of the runs")
    parser.add_argument("--file", type=Path, default=FILE, help="JSON file of what came of them")
    given = parser.parse_args(arguments)

    def inhabit(*words: str) -> None:
        subprocess.run([sys.executable, "-m", "console", *words], check=True)

    teach(given.runs, inhabit)
    found = kept(given.file)
    for row, seed in missing(found):
        found.append(train(row, seed, given.runs, inhabit))
        write_json(given.file, [asdict(one) for one in found])


if __name__ == "__main__":
    main()
