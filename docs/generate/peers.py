"""The results page of `inhabit bench peers` and `bench learning`, from the JSON that they write."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from console.bench.peers import pools
from console.bench.peers.figures import FLEETS, OURS_FLEET
from console.bench.peers.registry import NAMES, OURS, OURS_TASK, SCENES
from docs.generate import learning
from docs.generate.markdown import table

FILE = Path(__file__).parents[1] / "results" / "peers.json"


def page() -> str:
    """The page of the committed measurements: of speeds, then of returns."""
    return rendered(json.loads(FILE.read_text())) + learning.section()


def rendered(result: Mapping[str, Any]) -> str:
    """The page of a measurement."""
    figures, peers = result["figures"], result["peers"]
    machine = result["machine"]
    load = " and ".join(f"{value:.1f}" for value in result["load"])
    bf16 = "multiplies bf16 natively" if result["bf16"] else "has no native bf16"
    shared = (
        f"The load of the machine was {load} before and after: other work shared the cores, so that"
        " rates are of this machine at that time, and only ratios compare."
        if result["load"][0] >= 1.0
        else f"The machine was quiet: its load was {result['load'][0]:.1f} before."
    )
    setting = (
        f"Machine: {machine['cores']} cores of {machine['processor']}, which {bf16}; Python"
        f" {machine['python']}, torch {machine['versions']['torch']}, MuJoCo"
        f" {machine['versions']['mujoco']}. {result['rounds']} rounds of turns of at least"
        f" {result['turn_s']:g} s; {result['threads']} threads. {shared}\n"
    )
    others = [name for name in NAMES if name in peers]
    names = [name for name in (SCENES, OURS, OURS_TASK, *others) if name in result["turns"]]
    missing = [name for name in NAMES if name not in peers]
    left_out = f"Not measured: {', '.join(missing)}.\n" if missing else ""
    return "\n".join(
        [
            INTRODUCTION.replace("SECONDS", f"{result['turn_s']:g}").replace(
                "ROUNDS", str(result["rounds"])
            ),
            setting,
            left_out,
            table(RATES, (_rate(name, figures, peers) for name in names)),
            "Ratios: samples per second of inhabit over those of the library, in turns of the same"
            " round; the median, and the quartiles in brackets. The first two columns have the task"
            " reward alone on both sides; *with style* is whole training of inhabit, whose"
            " discriminator the others lack. Where other work shares the cores, the ratio of"
            " samples/s wanders with it: samples per processor second are the steadier measure.\n",
            table(RATIOS, (_ratios(name, figures, peers) for name in others)),
            _goals(figures, peers),
            "## What each computes\n",
            table(WHAT, (_what(peers[name]) for name in others)),
            # measurements without it are older than the setting of RLlib's noise
            METHOD if "sigma" in result else METHOD + RLLIB_NOISE,
            *_fleets(figures),
            *_pools(figures),
        ]
    )


INTRODUCTION = """# Side by side with other libraries

Whole PPO iterations on the same scenes: the task sit, preset `fast` (512 scenes, 8 control steps, 3
epochs of 2 minibatches, networks of 512 × 256 units for actor and critic). Each library has its own
process and environment, wraps the same shard as its vectorised environment, and trains by its own
PPO. This page is made from [peers.json](peers.json), which this command writes:

```sh
pip install 'inhabit[peers]'
inhabit bench peers --seconds SECONDS --rounds ROUNDS --json docs/results/peers.json
```

`--peer-python NAME=PATH ...` names interpreters of libraries that have environments of their own. A
library that is missing is left out by name.
"""
METHOD = """
- In a round every process takes one turn while the others wait; the next round goes the other way
  round. Two iterations before the first turn are not counted.
- A policy starts from random weights with an action noise of 0.05, so that the scenes are alike.
  The critic's warm-up of inhabit is off: it would leave out the actor's update.
- rsl_rl, skrl and TorchRL step the scenes in one worker process a core, with arrays in shared
  memory: threads of one process step at half that rate. The learner waits for each step. inhabit's
  workers infer the actions themselves and send a rollout once an iteration.
- RLlib has one environment runner a core, at the learner's priority (Ray's default gives runners a
  lower one), and no observation normaliser. Its iteration has some hundred samples more than the
  batch, which are counted.
- A time-out is bootstrapped by the value of the last observation (TorchRL, RLlib, inhabit), of the
  observation before (rsl_rl), or of the next episode's first (skrl): the interfaces of the last two
  have no place for it.
- *The scenes alone* steps the same scenes in such workers with random actions, and learns nothing.
- Memory is the sum of the peaks of resident memory of a library's processes (`VmHWM`); pages that
  processes share count in each. Lines are those of the adapter that hold code.
- This measurement is of speed alone; returns by samples are [below](#how-much-a-sample-teaches).
"""
RLLIB_NOISE = """\
- In this measurement RLlib's noise began at 1, the default of its networks.
"""
POOLS = f"""
## UniLab's stepping pool

UniLab steps its scenes by `BatchEnvPool` of {pools.DISTRIBUTION} {pools.VERSION}, which needs a
MuJoCo older than 3.12 and so an environment of its own: here with MuJoCo 3.11.0. Ours are stepped
by the Batch of MuJoCo 3.17. Both step the same model, a chair and a character, from the same
states, 20 control steps after the start of 512 scenes, with the same set-points and two threads.
The last row is the ratio of turns of the same round: of speeds, and of steps per processor second.
"""
OVER_RAY = """
## Over Ray

`inhabit train --runner ray` against RLlib's environment runners, each with a Ray of its own on this
machine, by the number of actors or runners; the 512 scenes are divided among them, and ours has the
task reward alone. With more actors than cores they share the cores.
"""
FLEET_HEADS = (
    "actors",
    "inhabit, samples/s",
    "RLlib, samples/s",
    "ratio of samples/s",
    "ratio of samples per processor second",
)
RATES = (
    "",
    "samples/s",
    "processor time of a sample, µs",
    "memory, GB",
    "lines of the adapter",
)
RATIOS = (
    "inhabit relative to",
    "samples/s",
    "samples per processor second",
    "with style, samples/s",
)
WHAT = ("library", "version", "bf16", "observations normalised by", "scenes")


def _rate(name: str, figures: Mapping[str, float], peers: Mapping[str, Any]) -> list[str]:
    own = {
        SCENES: "the scenes alone, without learning",
        OURS: "inhabit, with style",
        OURS_TASK: "inhabit, task reward alone",
    }
    return [
        own[name] if name in own else peers[name]["title"],
        _spread(f"{name}_samples_per_s", figures, ",.0f"),
        _spread(f"{name}_processor_us_per_sample", figures, ",.0f"),
        f"{figures[f'{name}_peak_gb']:.2f}",
        "" if name in own else str(peers[name]["code_lines"]),
    ]


def _ratios(name: str, figures: Mapping[str, float], peers: Mapping[str, Any]) -> list[str]:
    return [
        peers[name]["title"],
        _spread(f"{OURS_TASK}_to_{name}_ratio", figures, ".2f"),
        _spread(f"{OURS_TASK}_to_{name}_processor_ratio", figures, ".2f"),
        _spread(f"{OURS}_to_{name}_ratio", figures, ".2f"),
    ]


def _what(peer: Mapping[str, str]) -> list[str]:
    return [
        peer["title"],
        peer["installed"],
        peer["bf16"] or "nowhere",
        peer["normaliser"] or "nothing",
        peer["scenes"],
    ]


def _spread(name: str, figures: Mapping[str, float], form: str) -> str:
    low, high = figures[f"{name}_quartile_low"], figures[f"{name}_quartile_high"]
    return f"{figures[name]:{form}} ({low:{form}}-{high:{form}})"


def _pools(figures: Mapping[str, float]) -> list[str]:
    """The section on UniLab's stepping pool, where it was measured."""
    if "pool_to_unilab_ratio" not in figures:
        return []
    names = {pools.OURS: "MuJoCo's Batch", pools.UNILAB: "UniLab's pool"}
    rows = (
        [
            title,
            _spread(f"{name}_control_steps_per_s", figures, ",.0f"),
            _spread(f"{name}_processor_us_per_step", figures, ".1f"),
        ]
        for name, title in names.items()
    )
    ratios = [
        "Batch relative to the pool",
        _spread("pool_to_unilab_ratio", figures, ".2f"),
        _spread("pool_to_unilab_processor_ratio", figures, ".2f"),
    ]
    return [POOLS, table(("", "control steps/s", "processor time of a step, µs"), [*rows, ratios])]


def _fleets(figures: Mapping[str, float]) -> list[str]:
    """The section on Ray actors, where they were measured."""
    counts = sorted(
        int(name.removeprefix("fleet_").removesuffix("_processor_ratio"))
        for name in figures
        if name.startswith("fleet_") and name.endswith("_processor_ratio")
    )
    if not counts:
        return []
    rows = (
        [
            str(count),
            _spread(f"{OURS_FLEET}_{count}_samples_per_s", figures, ",.0f"),
            _spread(f"{FLEETS}_{count}_samples_per_s", figures, ",.0f"),
            _spread(f"fleet_{count}_ratio", figures, ".2f"),
            _spread(f"fleet_{count}_processor_ratio", figures, ".2f"),
        ]
        for count in counts
    )
    return [OVER_RAY, table(FLEET_HEADS, rows)]


def _goals(figures: Mapping[str, float], peers: Mapping[str, Any]) -> str:
    """One line on each goal that could be measured."""
    best = min(peers, key=lambda name: figures[f"{OURS_TASK}_to_{name}_ratio"])
    rows = [(f"the fastest, {peers[best]['title']}", "best")]
    rows += [("RLlib", "rllib")] if "rllib" in peers else []
    lines = []
    for title, name in rows:
        goal, found = figures[f"goal_to_{name}_ratio"], figures[f"to_{name}_ratio"]
        verdict = "met" if found >= goal else "missed"
        peer = best if name == "best" else name
        steady = figures[f"{OURS_TASK}_to_{peer}_processor_ratio"]
        lines.append(
            f"- Goal of {goal:g} × {title}: {verdict}, {found:.2f} in samples/s and {steady:.2f} in"
            " samples per processor second."
        )
    if f"{best}_of_scenes_processor_ratio" not in figures:
        return "\n".join(lines) + "\n"
    limit = figures[f"{OURS_TASK}_of_scenes_processor_ratio"]
    reach = figures[f"{best}_of_scenes_processor_ratio"]
    lines.append(
        f"- Why: everyone steps the same scenes, which take {100 * limit:.0f} % of inhabit's"
        f" processor time and {100 * reach:.0f} % of that of {peers[best]['title']}. A learner that"
        f" costs nothing would be {1 / reach:.2f} × as fast as {peers[best]['title']}."
    )
    return "\n".join(lines) + "\n"
