"""`inhabit bench servos`: random actions, and nobody set back on their feet, for ten minutes a
scene."""

import statistics
import time

import torch

from console.run.experiment import Experiment
from world import random_streams
from world.character import model as character
from world.scene.batch import Scenes
from world.scene.model import compile_scene

#: As long as it takes: simulated seconds of each scene.
SIMULATED_S = 600.0


def measure(experiment: Experiment, seconds: float, threads: int) -> dict[str, float]:
    """Actions uniform over all that a policy can ask for, until each scene has had SIMULATED_S or
    `seconds` are over; what blew up, and how fast joints turned (rad/s).

    They lie and flail on an empty floor: nothing that a policy does is as hard on the servos.
    """
    n = experiment.scenes
    world = experiment.world
    scenes = Scenes([compile_scene(None)] * n, world.action_scale, world.action_clip, threads)
    ids = torch.arange(n)
    standing = torch.from_numpy(character.standing_qpos()).expand(n, -1)
    yaw = torch.tensor([[1.0, 0.0]]).expand(n, -1)
    scenes.set_state(ids, standing, torch.zeros(n, character.NV), torch.zeros(n, 3), yaw)
    steps, blown, speeds = 0, 0, list[float]()
    began = time.perf_counter()
    while steps < SIMULATED_S * character.CONTROL_HZ and time.perf_counter() - began < seconds:
        draw = random_streams.uniform(
            experiment.seed, random_streams.ACTION_NOISE, ids, steps, character.NU
        )
        scenes.act((2.0 * draw - 1.0) * world.action_clip)
        blown += int((~scenes.finite()).sum())
        speeds.append(float(scenes.qvel[:, 6:].abs().max()))
        steps += 1
    return {
        "simulated_s_per_scene": steps / character.CONTROL_HZ,
        "blown_up_scenes": blown,
        "fastest_joint_rad_per_s": max(speeds),
        "fastest_joint_median_rad_per_s": statistics.median(speeds),
        "control_steps_per_s": n * steps / (time.perf_counter() - began),
    }
