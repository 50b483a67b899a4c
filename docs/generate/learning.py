"""The section on `inhabit bench learning` of the page on other libraries, from its JSON."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from console.bench.peers.curves import Run, figures_of, marks
from console.bench.peers.learning import LEARNERS
from console.bench.peers.registry import NAMES, OURS, OURS_EQUAL, by_name
from docs.generate.markdown import table

FILE = Path(__file__).parents[1] / "results" / "learning.json"
#: Seeds of the comparison, of which the page says what is missing.
SEEDS = 3
SAMPLES = 10_000_000


def section() -> str:
    """The section of the committed curves, or of none."""
    return rendered(json.loads(FILE.read_text()) if FILE.exists() else {})


def rendered(result: Mapping[str, Any]) -> str:
    """The section of the curves of a call, complete or not; {}: of none."""
    runs = [Run.from_json(run) for run in result.get("runs", ())]
    samples = result["plan"]["samples"] if runs else SAMPLES
    seeds = max(SEEDS, result.get("seeds", SEEDS))
    command = INTRODUCTION.replace("SAMPLES", str(samples)).replace("SEEDS", str(seeds))
    return "\n".join([command, *_results(runs, samples, seeds, result), METHOD])


INTRODUCTION = """
## How much a sample teaches

Returns at equal numbers of samples, on a smaller task: walk to a point on the floor and stand there
(`walk`, by its task reward alone). Each library trains from random weights, with its own PPO.

```sh
inhabit bench learning --samples SAMPLES --seeds SEEDS --json docs/results/learning.json
```

A call that is stopped loses the training that it is in; the same call again goes on with those that
the JSON lacks. `--only rsl_rl skrl` trains these alone, and `--peer-python` is as above.
"""
METHOD = """
- Batch, epochs, minibatches, discount, λ, clip range, hidden layers and the actor's initial
  learning rate are those of the speeds above (preset `fast`), as is the initial action noise of
  0.05. Nothing was tuned for any library on this task.
- Every episode begins in the rest pose, with the target at the distances of the preset: 1-10 m,
  or nearer. Success ends none, so that who arrives sooner returns more. Motion clips, style
  reward, behaviour cloning and the critic's warm-up are off.
- Rewards and ends of episodes are counted in the scenes, by the same code for every library. A
  figure is of the last window before its mark, a fortieth of all samples: the mean undiscounted
  return of the episodes that ended in it, the mean task reward of its control steps, and the
  share of these episodes that ended in a fall. The reward of a control step is 1 at most.
- These are training episodes, with each library's action noise, not evaluations of the mean
  action.
- A seed is that of networks, noise, minibatches and initial states. Curves are reproducible on
  the same machine with the same number of threads.
- **Action noise:** inhabit's is scheduled, 0.05 at the start and falling to 0.035 at 6 M samples;
  the others learn their deviation.
- **Learning rate:** inhabit has one for the actor, which follows the KL divergence from 0.0001
  on, and 0.0005 for the critic, as in `inhabit train`; the others have a constant 0.0001 for
  both. *Equal rates* is inhabit with that constant for both. rsl_rl's schedule by KL, its
  authors' default, is off.
- **Networks:** skrl and TorchRL begin with inhabit's networks, whose actor has a last layer of
  small weights; rsl_rl and RLlib build and initialise their own of the same size.
- **Normalisers:** RLlib has none of observations; inhabit and skrl also normalise returns.
- **Loss:** inhabit limits the gradient norm of the actor to 1 and of the critic to 5, skips steps
  of the actor beyond a multiple of the KL target, and penalises mean actions beyond 1. rsl_rl
  limits actor and critic to 1 each, the others both together. rsl_rl and skrl clip the value
  loss, and skrl weights it by 2.5.
- Other settings of a library are its defaults.
- **Time-outs** are bootstrapped as above.
- **Samples** are those that a library trains on. RLlib uses up a control step to begin an
  episode, which it does not train on; its reward counts in the scenes.
"""
HEADS = {
    "return": "Mean return of an episode:",
    "reward_per_step": "Mean task reward of a control step:",
    "falls_ratio": "Episodes that ended in a fall, %:",
}
_FORMS = {"return": (1.0, ".1f"), "reward_per_step": (1.0, ".3f"), "falls_ratio": (100.0, ".0f")}


def title(name: str) -> str:
    """The name of a library on the page."""
    if name in NAMES:
        return by_name(name).title
    return {OURS: "inhabit", OURS_EQUAL: "inhabit, equal rates"}[name]


def _results(
    runs: Sequence[Run], samples: int, seeds: int, result: Mapping[str, Any]
) -> Iterator[str]:
    missing = _missing(runs, seeds)
    if not runs:
        yield "No training is complete yet: there are no results.\n"
        return
    machine = result["machine"]
    yield (
        f"Means over the seeds, and the least and greatest in brackets. Machine:"
        f" {machine['cores']} cores of {machine['processor']}, torch"
        f" {machine['versions']['torch']}, MuJoCo {machine['versions']['mujoco']};"
        f" {result['threads']} threads. Curves: [{FILE.name}]({FILE.name}).\n"
    )
    yield (
        f"Not complete yet: {'; '.join(missing)}.\n"
        if missing
        else (f"All {len(LEARNERS) * seeds} trainings are complete.\n")
    )
    figures = figures_of(runs, samples)
    heads = ("", *(f"{mark / 1e6:g} M samples" for mark in marks(samples)), "seeds")
    for end, head in HEADS.items():
        yield f"{head}\n"
        yield table(heads, (_row(name, end, figures, runs, samples) for name in _present(runs)))


def _present(runs: Sequence[Run]) -> list[str]:
    return [name for name in LEARNERS if any(run.name == name for run in runs)]


def _missing(runs: Sequence[Run], seeds: int) -> list[str]:
    """Libraries with the seeds whose trainings are not complete."""
    complete = {(run.name, run.seed) for run in runs}
    found = []
    for name in LEARNERS:
        lacks = [str(seed) for seed in range(seeds) if (name, seed) not in complete]
        if lacks:
            found.append(f"{title(name)}, seed{'s' * (len(lacks) > 1)} {', '.join(lacks)}")
    return found


def _row(
    name: str, end: str, figures: Mapping[str, float], runs: Sequence[Run], samples: int
) -> list[str]:
    factor, form = _FORMS[end]
    cells = []
    for mark in marks(samples):
        figure = f"{name}_at_{mark}_{end}"
        if figure not in figures:
            cells.append("")
            continue
        middle, low, high = (
            f"{factor * figures[key]:{form}}"
            for key in (figure, f"{figure}_least", f"{figure}_greatest")
        )
        cells.append(f"{middle} ({low}-{high})")
    versions = sorted({run.version for run in runs if run.name == name})
    count = sum(run.name == name for run in runs)
    return [f"{title(name)} {', '.join(versions)}", *cells, str(count)]
