"""`inhabit bench world` on mujoco-warp: a shard's control step, its parts, and raw stepping."""

import time
from collections.abc import Callable

import torch

from console.bench.turns import turns
from console.run import assembly
from console.run.experiment import Experiment
from world import device as devices
from world import random_streams
from world.character.model import NU
from world.episodes.shard import Shard
from world.scene.simulators import require_warp

#: First control steps, which load kernels and fill caches and are not timed.
_FIRST = 3


def measure(experiment: Experiment, seconds: float, device: torch.device) -> dict[str, float]:
    """Return control steps/s of a shard and of raw stepping of its scenes, measured in turn from
    the same states; parts of a step in µs per scene; memory per scene.

    shard_to_raw_ratio: the time of raw stepping over that of the whole shard.
    """
    require_warp()
    from world.scene.warp_batch import WarpScenes, bytes_per_scene  # an extra of the package

    shard = Shard(
        experiment.world,
        assembly.library_of(experiment.world),
        assembly.training_bank(experiment.world),
        range(experiment.scenes),
        experiment.seed,
        simulator="warp",
        device=device,
        warp=experiment.warp,
    )
    scenes = shard._scenes
    assert isinstance(scenes, WarpScenes)
    ids = torch.arange(shard.n, device=device)
    spent: dict[str, float] = dict.fromkeys(("raw", "shard", "features", "policy_noise"), 0.0)

    def timed(part: str, call: Callable[[], object]) -> None:
        devices.synchronise(device)
        began = time.perf_counter()
        call()
        devices.synchronise(device)
        if steps >= _FIRST:
            spent[part] += time.perf_counter() - began

    steps, resets = 0, 0
    for turn in turns(seconds, _FIRST + 3):
        steps = turn
        noise: list[torch.Tensor] = []
        timed("policy_noise", lambda: noise.append(random_streams.normal(0, ids, steps, NU)))  # noqa: B023
        action = 0.3 * noise[0]
        before = scenes.physics()
        scenes.aim(action)
        timed("raw", scenes.step_raw)
        scenes.load_physics(before)
        ended: list[int] = []
        timed("shard", lambda: ended.append(len(shard.step(action).end_ids)))  # noqa: B023
        timed("features", scenes.body)
        resets += ended[0] if steps >= _FIRST else 0
        steps += 1
    counted = (steps - _FIRST) * shard.n
    each = bytes_per_scene(scenes.template, experiment.warp)
    return {
        "shard_control_steps_per_s": counted / spent["shard"],
        "raw_control_steps_per_s": counted / spent["raw"],
        "shard_to_raw_ratio": spent["raw"] / spent["shard"],
        **{f"{part}_us_per_step": 1e6 * value / counted for part, value in spent.items()},
        "resets_per_step": resets / (steps - _FIRST),
        "simulator_kb_per_scene": each / 1e3,
        "device_gb": devices.memory_used(device) / 1e9,
    }
