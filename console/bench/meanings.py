"""What each figure of a bench means, and whether it meets the limit that is stated for it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Meaning:
    """Meaning of the figures whose names match a pattern, which may use the pattern's groups."""

    pattern: str
    text: str
    sense: Literal["at least", "at most", ""] = ""
    """How the figure is compared with its limit; empty: it has none."""
    limit: float | str = 0.0
    """The limit, or the pattern's name of the figure that is the limit."""


NO_LIMIT = "none is set"

#: Names of `bench peers`.
_TRAINED = "(inhabit|inhabit_task|scenes|rsl_rl|skrl|torchrl|rllib)"

#: The first pattern that matches the whole name counts.
MEANINGS = (
    Meaning(r"goal_to_best_ratio", "goal: samples per second over those of the fastest peer"),
    Meaning(r"goal_to_rllib_ratio", "goal: samples per second over those of RLlib"),
    Meaning(r"to_best_ratio", "task reward alone: samples per second over those of the fastest"
            " peer", "at least", "goal_to_best_ratio"),
    Meaning(r"to_rllib_ratio", "task reward alone: samples per second over those of RLlib",
            "at least", "goal_to_rllib_ratio"),
    Meaning(r"inhabit_task_to_(\w+)_processor_ratio", r"task reward alone: samples per processor"
            r" second over those of \1"),
    Meaning(r"inhabit_task_to_(\w+)_ratio", r"task reward alone: samples per second over those"
            r" of \1"),
    Meaning(r"pool_to_unilab_ratio", "control steps per second of MuJoCo's Batch over those of"
            " UniLab's pool"),
    Meaning(r"pool_to_unilab_processor_ratio", "control steps per processor second of MuJoCo's"
            " Batch over those of UniLab's pool"),
    Meaning(r"pool_state_difference", "greatest difference of a coordinate or velocity after a"
            " control step, median over the scenes"),
    Meaning(r"(\w+)_pool_control_steps_per_s", r"stepping pool of \1: control steps per second"),
    Meaning(r"(\w+)_pool_processor_us_per_step", r"stepping pool of \1: processor time of a control"
            " step"),
    Meaning(r"(\w+)_of_scenes_processor_ratio", r"\1: samples per processor second over those of"
            " the scenes alone; 1 is the limit"),
    Meaning(r"inhabit_to_(\w+)_processor_ratio", r"samples per processor second over those of \1"),
    Meaning(r"inhabit_to_(\w+)_ratio", r"samples per second over those of \1"),
    Meaning(r"(\w+)_at_(\d+)_return", r"\1: undiscounted return of the episodes that ended in the"
            r" last window before \2 samples, mean over the seeds"),
    Meaning(r"(\w+)_at_(\d+)_reward_per_step", r"\1: task reward of a control step in the last"
            r" window before \2 samples, mean over the seeds"),
    Meaning(r"(\w+)_at_(\d+)_falls_ratio", r"\1: share of the episodes in the last window before \2"
            " samples that ended in a fall, mean over the seeds"),
    Meaning(r"goal_images_per_s", "goal of a film of 640 x 480 pixels on two quiet cores"),
    Meaning(r"quiet_images_per_s", "images per second of as many cores without other work, by the"
            " processor time of an image", "at least", "goal_images_per_s"),
    Meaning(r"images_per_s", "images per second of a film, drawn in several processes and encoded,"
            " beside whatever else runs"),
    Meaning(r"one_process_images_per_s", "images per second of a film drawn in one process"),
    Meaning(r"to_one_process_ratio", "images per second over those of one process, alternating"),
    Meaning(r"processor_ms_per_image", "processor time of an image of a film with all processes,"
            " the encoder's and their start"),
    Meaning(r"one_process_processor_ms_per_image", "processor time of an image of a film, drawn in"
            " one process"),
    Meaning(r"draw_processor_ms_per_image", "processor time to draw an image"),
    Meaning(r"differing_films", "films of several processes that differ from that of one",
            "at most", 0.0),
    Meaning(r"film_resident_gb", "memory of all processes while they draw and encode"),
    Meaning(r"samples_per_core_s", "samples of whole iterations per second of processor time"),
    Meaning(r"processor_us_per_sample", "processor time of a sample"),
    Meaning(r"(\w+)_of_iteration_ratio", r"share of \1 in the processor time of an iteration"),
    Meaning(r"(\w+)_of_physics_ratio", r"share of \1 in MuJoCo's step, by its timers"),
    Meaning(r"(\w+)_per_substep", r"\1 of a substep, mean"),
    Meaning(r"(\w+)_processor_us_per_sample", r"\1: processor time of a sample"),
    Meaning(rf"{_TRAINED}_samples_per_s", r"\1: samples per"
            " second of whole iterations"),
    Meaning(rf"{_TRAINED}_peak_gb", r"\1: sum of the peaks of"
            " resident memory of its processes"),
    Meaning(r"goal_to_echo_ratio", "goal: calls per second over those of a gRPC echo"),
    Meaning(r"goal_to_ray_ratio", "goal: calls per second over those of Ray Serve"),
    Meaning(r"goal_streams_256_p99_ms", "goal: 99th percentile of latency with 256 streams"),
    Meaning(r"(.+)_per_processor_s_to_(echo|ray)_ratio", r"\1: calls per second of processor time"
            r" over those of \2"),
    Meaning(r"(.+)_per_s_to_(echo|ray)_ratio", r"\1: calls per second over those of \2",
            "at least", r"goal_to_\2_ratio"),
    Meaning(r"(.+)_(p\d+)_ms_to_(echo|ray)_ratio", r"\1: \2 of latency over that of \3"),
    Meaning(r"policy_streams_256_p99_ms", "policy service: 99th percentile of latency, 256 streams",
            "at most", "goal_streams_256_p99_ms"),
    Meaning(r"(policy|echo|ray)_(.+)_(p\d+)_ms", r"\1, \2: \3 of latency"),
    Meaning(r"(policy|echo|ray)_(.+)_per_s", r"\1, \2: calls or rows per second"),
    Meaning(r"(.+)_per_processor_s", r"\1: calls per second of processor time"),
    Meaning(r"goal_samples_per_s", "goal of whole iterations of the preset, on two cores"),
    Meaning(r"samples_per_s", "samples per second of whole iterations",
            "at least", "goal_samples_per_s"),
    Meaning(r"to_goal_ratio", "samples per second over the goal; 1 meets it", "at least", 1.0),
    Meaning(r"(\w+)_to_limit_ratio", r"time of \1 alone over its time within an iteration; 1 is the"
            " limit"),
    Meaning(r"(\w+)_alone_s", r"time of \1 measured alone: its limit in an iteration"),
    Meaning(r"gather_s", "time until the rollouts of an iteration are joined"),
    Meaning(r"iteration_s", "time of an iteration"),
    Meaning(r"(world|policy|style)_s", r"time of \1 in an iteration"),
    Meaning(r"update_s", "time of one update of the networks (PPO)"),
    Meaning(r"update_us_per_sample", "time of an update by sample"),
    Meaning(r"samples", "samples of one update"),
    Meaning(r"epochs", "passes of one update over its samples"),
    Meaning(r"shard_to_raw_ratio", "control steps of a shard over those of MuJoCo alone; 1 is the"
            " limit"),
    Meaning(r"(shard|raw)_control_steps_per_s", r"control steps per second, \1, on one thread"),
    Meaning(r"(\w+)_us_per_step", r"time of a control step of one scene, \1"),
    Meaning(r"us_per_step", "time of a control step of one scene"),
    Meaning(r"memory_1024_scenes_gb", "memory of 1,024 scenes"),
    Meaning(rf"{_TRAINED}_resident_gb", r"\1: greatest"
            " resident memory of its processes at the end of a turn"),
    Meaning(r"(process|resident)_gb", "memory of the process, or of it and its children"),
    Meaning(r"device_gb", "memory of the device"),
    Meaning(r"in_process_ms", "scoring of one rollout, in process"),
    Meaning(r"grpc_ms", "scoring of one rollout over gRPC"),
    Meaning(r"transport_ms", "what gRPC adds to the scoring of one rollout"),
    Meaning(r"train_ms", "one training of the discriminator"),
    Meaning(r"iteration_at_goal_ms", "time of an iteration at the goal"),
    Meaning(r"transport_of_iteration_ratio", "what gRPC adds, of an iteration at the goal"),
    Meaning(r"grpc_to_in_process_ratio", "scoring over gRPC over scoring in process"),
    Meaning(r"simulated_s_per_scene", "simulated time of each scene"),
    Meaning(r"blown_up_scenes", "scenes whose state became non-finite", "at most", 0.0),
    Meaning(r"broken_scenes_count", "scenes whose state became non-finite", "at most", 0.0),
    Meaning(r"fastest_joint_rad_per_s", "greatest speed of a joint"),
    Meaning(r"fastest_joint_median_rad_per_s", "median over time of the greatest joint speed"),
    Meaning(r"(mixed|chair)_control_steps_per_s", r"control steps per second, furniture: \1"),
    Meaning(r"mixed_to_chair_time_ratio", "time of a step with mixed pieces over a plain chair's"),
    Meaning(r"swap_ms", "exchange of the pieces of all scenes"),
    Meaning(r"compile_ms_per_piece", "compilation of a piece"),
    Meaning(r"model_mb", "memory of a model"),
    Meaning(r"(pieces|slots)_count", r"number of \1"),
    Meaning(r"control_steps_per_s", "control steps per second"),
    Meaning(r"held_ratio", "share of the steps in which the box is held"),
    Meaning(r"to_(dense|pyramidal)_time_ratio", r"time of a step over that of \1 contacts"),
    Meaning(r"to_(dense|pyramidal)_gap_rad_per_s", r"difference of joint speeds from \1 contacts"),
    Meaning(r"(.+)_growth_ratio", r"memory of \1 at the end over that after the warm-up"),
    Meaning(r"(.+)_(warm|end)_mb", r"memory of \1, \2"),
    Meaning(r"(.*)actors_(\d+)_(fast_tenth_)?to_ideal_ratio", r"intake of \2 actors over what they"
            r" send"),
    Meaning(r"(.*)actors_(\d+)_(fast_tenth_)?to_reachable_ratio", r"intake of \2 actors over the"
            " lesser of what they send and the learner's limit; 1 is the limit"),
    Meaning(r"(.*)actors_(\d+)_(.+)", r"\2 actors: \3"),
    Meaning(r"(.*)exceptions", r"damaged files that ended in an exception \1", "at most", 0.0),
    Meaning(r"(.*)(crashes|deaths|hangs|killed)", r"damaged files: \2 \1", "at most", 0.0),
    Meaning(r"mutations", "damaged files that were read"),
    Meaning(r"fair_alone_(p\d+)_ms", r"characters without a flood: \1 of latency"),
    Meaning(r"fair_flood_(\w+)_p99_ratio", r"characters while another client floods with \1: p99"
            " over that without", "at most", "limit_fair_p99_ratio"),
    Meaning(r"fair_flood_(\w+)_(p\d+)_ms", r"characters while another client floods with \1: \2 of"
            " latency"),
    Meaning(r"limit_fair_p99_ratio", "limit of the p99 while another client floods over that"
            " without"),
    Meaning(r"fair_within_limit", "whether all floods are within the limit; 1 is yes",
            "at least", 1.0),
)  # fmt: skip


def meaning(name: str) -> str:
    """Return what a figure means; a name without a meaning of its own is read as words."""
    found = _found(name)
    if found is None:
        return name.replace("_", " ")
    entry, match = found
    return match.expand(entry.text).replace("_", " ").strip()


def verdict(name: str, figures: Mapping[str, float]) -> str:
    """Return whether a figure meets its limit, with the limit; or that none is set for it."""
    found = _found(name)
    if found is None or not found[0].sense:
        return NO_LIMIT
    entry, match = found
    limit = entry.limit
    if isinstance(limit, str):
        other = match.expand(limit)
        if other not in figures:
            return f"{NO_LIMIT} here: {other} is not among the figures"
        limit = figures[other]
    value = figures[name]
    met = value >= limit if entry.sense == "at least" else value <= limit
    return f"{'met' if met else 'MISSED'}: {entry.sense} {limit:,.4g}"


def _found(name: str) -> tuple[Meaning, re.Match[str]] | None:
    for entry in MEANINGS:
        match = re.fullmatch(entry.pattern, name)
        if match is not None:
            return entry, match
    return None
