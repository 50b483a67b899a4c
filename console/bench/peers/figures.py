"""Figures of `inhabit bench peers`: rates, and ratios of turns of one round, with quartiles."""

import statistics
from collections.abc import Mapping, Sequence

from console.bench.peers import pools
from console.bench.peers.protocol import Turn
from console.bench.peers.registry import NAMES, OURS, OURS_TASK, SCENES

#: Goals of issue and results page: over the best peer, and over RLlib.
GOALS = {"best": 1.5, "rllib": 5.0}
#: The peer whose distributed training ours is compared with, and ours in these figures.
FLEETS, OURS_FLEET = "rllib", "inhabit_ray"


def figures_of(turns: Mapping[str, Sequence[Turn]]) -> dict[str, float]:
    """Return the figures of turns: rates and memory of each, and ratios of ours to each peer.

    Rates and ratios are medians over the rounds with the quartiles; ratios are of turns of one
    round, by wall time and by processor time.
    """
    found: dict[str, float] = {}
    for name, taken in turns.items():
        found |= _spread(f"{name}_samples_per_s", [turn.rate for turn in taken])
        found |= _spread(
            f"{name}_processor_us_per_sample", [1e6 / turn.processor_rate for turn in taken]
        )
        found[f"{name}_resident_gb"] = max(turn.resident_gb for turn in taken)
        found[f"{name}_peak_gb"] = max(turn.peak_gb for turn in taken)
    peers = [name for name in turns if name in NAMES]
    for name in (OURS_TASK, *peers) if SCENES in turns else ():
        pairs = list(zip(turns[name], turns[SCENES], strict=True))
        found |= _spread(
            f"{name}_of_scenes_processor_ratio",
            [a.processor_rate / b.processor_rate for a, b in pairs],
        )
    for ours in (OURS_TASK, OURS):
        for name in peers:
            pairs = list(zip(turns[ours], turns[name], strict=True))
            found |= _spread(f"{ours}_to_{name}_ratio", [a.rate / b.rate for a, b in pairs])
            found |= _spread(
                f"{ours}_to_{name}_processor_ratio",
                [a.processor_rate / b.processor_rate for a, b in pairs],
            )
    best = min(peers, key=lambda name: found[f"{OURS_TASK}_to_{name}_ratio"])
    found["to_best_ratio"] = found[f"{OURS_TASK}_to_{best}_ratio"]
    found["goal_to_best_ratio"] = GOALS["best"]
    if "rllib" in peers:
        found["to_rllib_ratio"] = found[f"{OURS_TASK}_to_rllib_ratio"]
        found["goal_to_rllib_ratio"] = GOALS["rllib"]
    return found


def _spread(name: str, values: Sequence[float]) -> dict[str, float]:
    low, _, high = statistics.quantiles(values, n=4, method="inclusive")
    middle = statistics.median(values)
    return {name: middle, f"{name}_quartile_low": low, f"{name}_quartile_high": high}


def pool_figures(turns: Mapping[str, Sequence[Turn]], difference: float) -> dict[str, float]:
    """Return the figures of the stepping pools; nothing without turns."""
    if not turns:
        return {}
    found: dict[str, float] = {}
    for name, taken in turns.items():
        found |= _spread(f"{name}_control_steps_per_s", [turn.rate for turn in taken])
        found |= _spread(
            f"{name}_processor_us_per_step", [1e6 / turn.processor_rate for turn in taken]
        )
    pairs = list(zip(turns[pools.OURS], turns[pools.UNILAB], strict=True))
    found |= _spread("pool_to_unilab_ratio", [a.rate / b.rate for a, b in pairs])
    found |= _spread(
        "pool_to_unilab_processor_ratio", [a.processor_rate / b.processor_rate for a, b in pairs]
    )
    return found | {"pool_state_difference": difference}


def fleet_figures(turns: Mapping[str, Sequence[Turn]]) -> dict[str, float]:
    """Return the figures of the fleets, by number of actors; nothing without turns."""
    found: dict[str, float] = {}
    for ours in turns:
        kind, _, count = ours.rpartition("_")
        if kind != OURS_FLEET:
            continue
        for name in (ours, f"{FLEETS}_{count}"):
            found |= _spread(f"{name}_samples_per_s", [turn.rate for turn in turns[name]])
            found |= _spread(
                f"{name}_processor_us_per_sample",
                [1e6 / turn.processor_rate for turn in turns[name]],
            )
        pairs = list(zip(turns[ours], turns[f"{FLEETS}_{count}"], strict=True))
        found |= _spread(f"fleet_{count}_ratio", [a.rate / b.rate for a, b in pairs])
        found |= _spread(
            f"fleet_{count}_processor_ratio",
            [a.processor_rate / b.processor_rate for a, b in pairs],
        )
    return found
