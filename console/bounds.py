"""Bounds of every number on the command line, shown in its help and checked before a command runs.

NaN is within no bounds. A numeric field without bounds fails the tests.
"""

import dataclasses
import typing
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from world.errors import ConfigError

Span = tuple[float, float]
_SEED: Span = (0, 2**63 - 1)
_COUNT: Span = (1, 1e9)
_FRACTION: Span = (0, 1)
_THREADS: Span = (1, 1024)
_LENGTH_M: Span = (0, 100)
_LAG: Span = (0, 1000)
#: Samples of a schedule's (samples, value) points.
_SAMPLES: Span = (0, 1e15)

#: By class and field; two spans belong to the (samples, value) points of a schedule.
BOUNDS: dict[str, dict[str, tuple[Span, ...]]] = {
    "Experiment": {
        "seed": (_SEED,), "scenes": ((1, 1e6),), "horizon": ((1, 1e4),), "block": ((1, 1e5),),
        "clone_passes": ((0, 1e4),), "clone_samples": ((1, 1e8),),
    },
    "Stage": {
        "success": (_FRACTION,), "episodes": (_COUNT,), "at_least": ((0, 1e15),),
        "limit": ((1, 1e15),),
    },
    "WarpConfig": {"nconmax": ((1, 1e5),), "njmax": ((1, 1e5),)},
    "LagConfig": {"max_policy": (_LAG,), "max_style": (_LAG,)},
    "WorldConfig": {
        "playback_speeds": ((0.25, 4),), "pieces": ((1, 1e5),), "scales": ((1, 1e3),),
        "scale": ((0.1, 10),), "episode_s": ((0.1, 3600),), "hold_s": ((0, 3600),),
        "early_pelvis_m": ((-10, 10),), "stall_s": ((0.1, 3600),), "action_scale": ((0, 10),),
        "action_clip": ((0, 1000),), "seed": (_SEED,),
    },
    "InitialStates": {
        "reference": (_FRACTION,), "near": (_FRACTION,), "far": (_FRACTION,),
        "reference_stages": (_FRACTION,), "raised_seat_fraction": (_FRACTION,),
        "standing_fraction": (_FRACTION,), "near_m": (_LENGTH_M,),
        "front_fraction": (_FRACTION,), "front_m": (_LENGTH_M,), "far_m": (_LENGTH_M,),
        "ahead_fraction": (_FRACTION,), "focus": (_FRACTION,),
    },
    "CarryConfig": {
        "scale": ((0.1, 10),), "sizes": ((1, 1e5),), "weight_kg": ((0.01, 1000),),
        "stand_m": ((0, 10),), "target_m": (_LENGTH_M,), "near_target": (_FRACTION,),
        "near_target_m": (_LENGTH_M,), "in_hand": (_FRACTION,), "putting_down": (_FRACTION,),
    },
    "PerturbConfig": {
        "fraction": (_FRACTION,), "pushes_per_s": ((0, 30),), "push_n_s": ((0, 1000),),
        "projectiles_per_s": ((0, 30),), "moved_fraction": (_FRACTION,),
    },
    "PenaltyConfig": {"skating": ((0, 100),), "jerk": ((0, 100),), "hands": ((0, 100),)},
    "TrackConfig": {
        "boxes": ((1, 1e4),), "size": ((0.1, 10),), "weight_kg": ((0.01, 1000),),
        "friction": ((0.01, 100),), "focus": (_FRACTION,), "handling": ((0, 1e6),),
        "displaced_m": ((0, 0.6),),
    },
    "LearnerConfig": {
        "hidden": ((1, 16384),), "sigma": (_SAMPLES, (1e-4, 10)), "task_weight": ((0, 1000),),
        "style_weight": ((0, 1000),), "gamma": (_FRACTION,), "lam": (_FRACTION,),
        "epochs": ((1, 1000),),
        "minibatch": ((1, 1e8),), "clip": (_SAMPLES, (0, 10)), "kl_target": (_SAMPLES, (0, 100)),
        "kl_skip": ((0, 1e6),), "actor_rate": (_FRACTION,), "actor_rate_bounds": (_FRACTION,),
        "critic_rate": (_FRACTION,), "actor_grad_norm": ((0, 1e6),),
        "critic_grad_norm": ((0, 1e6),),
        "bound_weight": ((0, 1e6),), "mirror_weight": ((0, 1e6),), "imitation_weight": ((0, 1e6),),
        "imitation_samples": ((0, 1e12),),
        "average": (_FRACTION,), "warmup_iterations": ((0, 1e6),),
        "observation_clip": ((0.1, 1e6),),
        "observation_std_floor": ((1e-6, 10),), "threads": (_THREADS,),
    },
    "StyleConfig": {
        "hidden": ((1, 16384),), "learning_rate": (_FRACTION,), "steps_per_iteration": ((0, 1e4),),
        "batch": ((2, 1e7),), "gradient_penalty": ((0, 1e6),), "penalty_batch": ((1, 1e7),),
        "logit_regulariser": ((0, 1e6),), "weight_decay": ((0, 1e3),), "replay": ((1, 1e8),),
        "window": ((2, 64),),
        "insert_probability": (_FRACTION,), "clamp": ((1e-12, 1),), "reward_scale": ((0, 1e6),),
        "held_out_batch": ((1, 1e7),), "throttle": ((0.5, 1),),
        "normaliser_samples": ((2, 1e8),),
    },
    "Train": {
        "samples": ((1, 1e15),), "iterations": (_COUNT,), "minutes": ((0.001, 1e6),),
        "threads": (_THREADS,), "actors": ((1, 1e5),), "checkpoint_every": (_COUNT,),
        "keep": ((1, 1e6),),
    },
    "Evaluate": {
        "trials": ((1, 1e7),), "near_m": (_LENGTH_M,), "far_m": (_LENGTH_M,),
        "quality": ((0, 1e6),),
        "seed": (_SEED,), "threads": (_THREADS,), "record_trials": ((1, 1e4),),
        "worst": ((0, 200),),
    },
    "Realism": {
        "trials": ((2, 1e5),), "folds": ((1, 100),), "noise_rad": ((0, 10),),
        "seed": (_SEED,), "threads": (_THREADS,),
    },
    "Report": {"trials": ((1, 1e6),), "seed": (_SEED,), "threads": (_THREADS,)},
    "Publish": {"average": ((1, 1000),)},
    "Video": {
        "trials": ((1, 1000),), "seconds": ((0.1, 3600),), "near_m": (_LENGTH_M,),
        "far_m": (_LENGTH_M,), "seed": (_SEED,), "threads": (_THREADS,),
        "width": ((16, 8192),), "height": ((16, 8192),),
    },
    "Serve": {"drain_s": ((0, 3600),), "max_message_mb": ((0.01, 1000),)},
    "BatchConfig": {
        "max_rows": ((1, 65536),), "max_wait_s": ((0, 10),), "max_queued_rows": ((1, 1e7),),
    },
    "SynthesisConfig": {
        "max_at_a_time": ((1, 1024),), "max_s": ((0.1, 3600),), "buffer_frames": ((1, 1e4),),
    },
    "PolicyServiceConfig": {
        "max_rows": ((1, 1e6),), "max_poses": ((1, 65536),), "max_streams": ((1, 1e6),),
        "idle_s": ((0.1, 1e5),), "stalled_s": ((0.1, 1e5),), "poll_s": ((0.05, 3600),),
    },
    "Synthesize": {
        "place": ((0, 1000),), "scale": ((0.2, 5),), "stand_m": ((0, 10),),
        "box_kg": ((0.01, 1000),),
        "seconds": ((1 / 30, 600),), "seed": (_SEED,), "tries": ((1, 1e4),),
    },
    "Bench": {
        "scenes": ((1, 1e6),), "threads": (_THREADS,), "seconds": ((0.1, 1e6),),
        "mutations": ((1, 1e9),), "rounds": ((1, 1e4),), "samples": ((1, 1e12),),
        "seeds": ((1, 1e4),),
        "fleet_actors": ((1, 512),),
    },
    "Demo": {"seed": (_SEED,)},
    "Export": {"take": ((0, 1e6),)},
    "Plan": {
        "actors": ((1, 1e5),), "scenes": ((1, 1e8),), "network": ((1, 16384),),
        "horizon": ((1, 1e4),), "learner_cores": ((1, 1024),), "gbit_per_s": ((0.001, 1e6),),
        "samples": ((1, 1e15),), "price": ((0, 1e6),), "seconds": ((0.1, 3600),),
    },
    "Doctor": {"seconds": ((0, 3600),)},
    "Dagger": {
        "minutes": ((0.001, 1e6),), "batches": (_COUNT,), "workers": (_THREADS,),
        "batch": ((1, 1e7),), "rate": (_FRACTION,), "spell": ((0.001, 1e6),),
        "first": ((1, 1e8),), "capacity": ((1, 1e8),), "hidden": ((1, 16384),),
    },
    "Labelled": {
        "steps": ((1, 1e5),), "scenes": ((1, 1e6),), "noise": ((0, 10),), "seed": (_SEED,),
    },
    "MotionsImport": {"fps": ((1, 1000),)},
    "MotionsCheck": {"fps": ((1, 1000),)},
    "MotionsVary": {"stand_m": ((0, 2),), "size": ((0.3, 3),)},
    "Meshes": {"height": ((0.01, 100),), "threads": (_THREADS,)},
    "ObjectsCheck": {"drop": ((0, 60),)},
    "ObjectsShow": {"limit": ((1, 1e5),)},
}  # fmt: skip


def numeric(kind: type) -> Iterator[str]:
    """Yield the fields of a dataclass that hold numbers, alone or in tuples."""

    def holds(hint: Any) -> bool:
        return hint in (int, float) or any(map(holds, typing.get_args(hint)))

    hints = typing.get_type_hints(kind)
    for field in dataclasses.fields(kind):
        hint = hints[field.name]
        if not dataclasses.is_dataclass(hint) and holds(hint):
            yield field.name


@lru_cache(maxsize=64)
def ranges(kind: type) -> frozenset[str]:
    """Return the fields of a dataclass that hold the least and the greatest of something."""
    hints = typing.get_type_hints(kind)
    pair = tuple[float, float]
    return frozenset(
        field.name for field in dataclasses.fields(kind) if hints[field.name] in (pair, pair | None)
    )


def text(kind: type, field: str) -> str:
    """Return the bounds of a field as shown in its help and errors; empty for a field without."""
    spans = BOUNDS.get(kind.__name__, {}).get(field)
    if spans is None:
        return ""
    return ", ".join(
        f"{low:.6g} to {high if isinstance(high, int) else f'{high:.10g}'}" for low, high in spans
    )


def _shown(number: float) -> str:
    """A number as it is typed: no digit is lost, and none is there for nothing."""
    if isinstance(number, int):
        return str(number)
    short = f"{number:.10g}"
    return short if float(short) == number or number != number else repr(number)


def require(command: Any, prefix: str = "--") -> None:
    """Raise ConfigError, which names flag, value and bounds, for a number out of bounds."""
    kind = type(command)
    spans = BOUNDS.get(kind.__name__, {})
    for field in dataclasses.fields(command):
        value = getattr(command, field.name)
        name = field.name.replace("_", "-")
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            require(value, prefix if field.name in UNNAMED else f"{prefix}{name}.")
        elif field.name in spans and value is not None:
            _within(value, spans[field.name], f"{prefix}{name}", text(kind, field.name))
            if field.name in ranges(kind):
                _ordered(value, f"{prefix}{name}")
            if len(spans[field.name]) > 1:
                _scheduled(value, f"{prefix}{name}")


UNNAMED = ("dagger", "experiment", "files", "mesh", "practice", "service")
"""Fields whose flags have no prefix."""


def _ordered(value: Any, flag: str) -> None:
    low, high = value
    if low > high:
        raise ConfigError(
            f"{flag} {_shown(low)} {_shown(high)}: the first is the least, the second the"
            f" greatest; give {_shown(high)} {_shown(low)}"
        )


def _scheduled(value: Any, flag: str) -> None:
    """Raise ConfigError for a schedule without points, or whose samples descend. Two points of the
    same samples are a jump."""
    if not value:
        raise ConfigError(f"{flag}: give SAMPLES VALUE, once or more")
    ordered = sorted(value, key=lambda point: point[0])
    if list(value) != ordered:
        given, right = (
            " ".join(_shown(number) for point in points for number in point)
            for points in (value, ordered)
        )
        raise ConfigError(f"{flag} {given}: the samples of a schedule ascend; give {flag} {right}")


def _within(value: Any, spans: tuple[Span, ...], flag: str, form: str) -> None:
    if isinstance(value, tuple | list):
        paired = len(spans) > 1 and all(not isinstance(one, tuple | list) for one in value)
        for index, one in enumerate(value):
            _within(one, (spans[index % len(spans)],) if paired else spans, flag, form)
        return
    low, high = spans[0]
    if not low <= value <= high:
        raise ConfigError(f"{flag} {_shown(value)}: must be {form}")
