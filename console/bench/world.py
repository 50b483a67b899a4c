"""`inhabit bench world`: a shard's control step against that of the raw simulator batch."""

import time

import torch

from console.bench.turns import turns
from console.run import assembly, machine
from console.run.experiment import Experiment
from world import random_streams
from world.character.model import NU, SUBSTEPS
from world.scene.batch import Scenes

MEMORY_SCENES = 1024


def measure(experiment: Experiment, seconds: float, threads: int = 1) -> dict[str, float]:
    """Return control steps/s of both on one thread, their ratio, and memory of 1,024 scenes.

    Before each step the raw batch gets the shard's state and controls, so that both step the same
    physics; only the steps are timed.
    """
    scenes = range(experiment.scenes)
    assembly.training_bank(experiment.world)
    shard = assembly.shard(experiment.world, scenes, experiment.seed)
    bank = assembly.training_bank(experiment.world)
    raw = Scenes(
        [bank.models[0]] * shard.n,
        experiment.world.action_scale,
        experiment.world.action_clip,
        threads,
    )
    ids = torch.arange(shard.n)
    whole, alone, done = 0.0, 0.0, 0
    for steps in turns(seconds, 10):
        action = 0.3 * random_streams.normal(experiment.seed, ids, steps, NU)
        state = shard.state_dict()
        raw.set_models(range(shard.n), [bank.models[v] for v in state["variant"].tolist()])
        physics = {k.removeprefix("physics_"): v for k, v in state.items() if "physics_" in k}
        raw.load_physics(physics)
        raw.aim(action)
        start = time.perf_counter()
        raw.batch.step(nstep=SUBSTEPS)
        middle = time.perf_counter()
        shard.step(action)
        end = time.perf_counter()
        if steps >= 3:  # the first steps fill caches
            alone += middle - start
            whole += end - middle
        done = steps + 1
    counted = (done - 3) * shard.n
    return {
        "shard_control_steps_per_s": counted / whole,
        "raw_control_steps_per_s": counted / alone,
        "shard_to_raw_ratio": alone / whole,
        "shard_us_per_step": 1e6 * whole / counted,
        "raw_us_per_step": 1e6 * alone / counted,
        "memory_1024_scenes_gb": memory_gb(experiment),
        "process_gb": machine.resident_gb(),
    }


def memory_gb(experiment: Experiment) -> float:
    """Return the memory of a shard of 1,024 scenes after a step, without furniture, GB."""
    before = machine.resident_gb()
    shard = assembly.shard(experiment.world, range(MEMORY_SCENES), experiment.seed)
    shard.step(torch.zeros(MEMORY_SCENES, NU))
    return machine.resident_gb() - before
