"""`inhabit bench servos`: random actions without resets, for ten minutes per scene."""

import statistics
import time

import torch

from console.bench.turns import turns
from console.run.experiment import Experiment
from world import random_streams
from world.character import model as character
from world.scene.batch import Scenes
from world.scene.model import compile_scene

#: Simulated time of each scene, s.
SIMULATED_S = 600.0


def measure(experiment: Experiment, seconds: float, threads: int) -> dict[str, float]:
    """Simulate uniform random actions over the whole range, for SIMULATED_S per scene or `seconds`
    in all; return the number of non-finite scenes and joint speeds (rad/s).

    Characters lie on an empty floor with violent motion, a harder test of the servos than any
    policy.
    """
    n = experiment.scenes
    world = experiment.world
    scenes = Scenes([compile_scene(None)] * n, world.action_scale, world.action_clip, threads)
    ids = torch.arange(n)
    standing = torch.from_numpy(character.standing_qpos()).expand(n, -1)
    yaw = torch.tensor([[1.0, 0.0]]).expand(n, -1)
    scenes.set_state(ids, standing, torch.zeros(n, character.NV), torch.zeros(n, 3), yaw)
    blown, speeds = 0, list[float]()
    began = time.perf_counter()
    for step in turns(seconds, 1, most=round(SIMULATED_S * character.CONTROL_HZ)):
        draw = random_streams.uniform(
            experiment.seed, random_streams.ACTION_NOISE, ids, step, character.NU
        )
        scenes.act((2.0 * draw - 1.0) * world.action_clip)
        blown += int((~scenes.finite()).sum())
        speeds.append(float(scenes.qvel[:, 6:].abs().max()))
    steps = len(speeds)
    return {
        "simulated_s_per_scene": steps / character.CONTROL_HZ,
        "blown_up_scenes": blown,
        "fastest_joint_rad_per_s": max(speeds),
        "fastest_joint_median_rad_per_s": statistics.median(speeds),
        "control_steps_per_s": n * steps / (time.perf_counter() - began),
    }
