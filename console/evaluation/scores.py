"""Figures of the paper's tables from the results of trials, with confidence intervals."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

DISTANCES_M = ((1.0, 3.0), (3.0, 6.0), (6.0, 10.0))
Z95 = 1.959963984540054


@dataclass(frozen=True)
class Protocol:
    """Criteria of success; the defaults are the paper's for sit (section 7.1)."""

    success_m: float = 0.20
    """Largest distance of the hip from its target, m."""
    limit_s: float = 20.0
    """Time limit of reaching the target, s."""
    hold_s: float = 1.0
    """Time that the target must be held for a sustained success, s."""
    control_hz: int = 30

    @property
    def limit_steps(self) -> int:
        return round(self.limit_s * self.control_hz)

    @property
    def hold_steps(self) -> int:
        return round(self.hold_s * self.control_hz)

    @property
    def steps(self) -> int:
        """Number of steps to simulate: a success at the time limit can still be held."""
        return self.limit_steps + self.hold_steps


@dataclass(frozen=True)
class Outcomes:
    """Outcomes of n trials, arrays [n]."""

    success: NDArray[np.bool_]
    held: NDArray[np.bool_]
    """At the target for the uninterrupted hold time, from within the limit on, before any fall."""
    sustained: NDArray[np.bool_]
    """Held, without a later fall."""
    fell: NDArray[np.bool_]
    """Fell within the limit, before or after the success."""
    time_s: NDArray[np.float64]
    """Time of first reaching the target, s; NaN without success."""
    precision_m: NDArray[np.float64]
    """Smallest distance within the limit, m; NaN without success."""


def judge(error_m: NDArray[np.float32], fell_at: NDArray[np.int64], protocol: Protocol) -> Outcomes:
    """Return the outcomes of n trials.

    error_m: [n, steps] distance of the hip from its target after each control step, m.
    fell_at: [n] the step that ended the trial by a fall; `steps` without a fall.
    Precision is the smallest distance, as in the published evaluation of TokenHSI; success and
    hold count before a fall alone.
    """
    n, steps = error_m.shape
    moment = np.arange(steps)
    upright = moment[None] < fell_at[:, None]
    near = (error_m <= protocol.success_m) & upright
    within = near[:, : protocol.limit_steps]
    success = within.any(1)
    time_s = np.where(success, (within.argmax(1) + 1) / protocol.control_hz, np.nan)
    reached = np.where(upright, error_m, np.inf)[:, : protocol.limit_steps].min(1)
    precision = np.where(success, reached, np.nan).astype(np.float64)
    total = np.concatenate([np.zeros((n, 1), np.int64), near.cumsum(1)], axis=1)
    hold = protocol.hold_steps
    held = (total[:, hold:] - total[:, :-hold]) == hold
    starts = min(protocol.limit_steps, held.shape[1])
    held = held[:, :starts].any(1)
    sustained = held & (fell_at >= steps)
    return Outcomes(success, held, sustained, fell_at < protocol.limit_steps, time_s, precision)


def wilson(successes: int, trials: int, z: float = Z95) -> tuple[float, float]:
    """Return Wilson's score interval of a proportion; (0, 1) without trials.

    Source: Wilson 1927; unlike the normal interval it stays within [0, 1].
    """
    if trials == 0:
        return 0.0, 1.0
    rate = successes / trials
    scale = 1.0 + z * z / trials
    centre = (rate + z * z / (2 * trials)) / scale
    half = z / scale * math.sqrt(rate * (1 - rate) / trials + z * z / (4 * trials * trials))
    return max(0.0, centre - half), min(1.0, centre + half)


def proportion(hits: NDArray[np.bool_]) -> dict[str, Any]:
    """Return `rate` and `ci95` of a boolean array."""
    low, high = wilson(int(hits.sum()), len(hits))
    return {"rate": float(hits.mean()) if len(hits) else 0.0, "ci95": [low, high]}


def by_stage(reached: NDArray[np.bool_], names: Sequence[str]) -> list[dict[str, Any]]:
    """Return the fraction of the trials that reached each stage of a task, in its order.

    reached: [n, stages], whether each was true once before the trial's end; names: of the stages.
    """
    return [
        {"stage": name, **proportion(column)} for name, column in zip(names, reached.T, strict=True)
    ]


def summarise(
    outcomes: Outcomes, objects: list[str], distance_m: NDArray[np.float64]
) -> dict[str, Any]:
    """Return the figures of the evaluation JSON; `objects`: names of the trials' pieces."""
    success = outcomes.success
    names = np.array(objects)
    by_object = [
        {
            "object": str(name),
            "trials": int((names == name).sum()),
            "success": float(success[names == name].mean()),
        }
        for name in sorted(set(objects))
    ]
    by_distance = []
    for low, high in DISTANCES_M:
        inside = (distance_m >= low) & (distance_m < high)
        rate = float(success[inside].mean()) if inside.any() else None
        by_distance.append(
            {"from_m": low, "to_m": high, "trials": int(inside.sum()), "success": rate}
        )
    return {
        "success": proportion(success),
        "sustained": proportion(outcomes.sustained),
        "time_s": _mean(outcomes.time_s),
        "precision_m": _mean(outcomes.precision_m),
        "falls": float(outcomes.fell.mean()) if len(success) else 0.0,
        "by_object": by_object,
        "by_distance": by_distance,
    }


def _mean(values: NDArray[np.float64]) -> float | None:
    """Return the mean of the values that are not NaN; None without any."""
    valid = values[~np.isnan(values)]
    return float(valid.mean()) if len(valid) else None
