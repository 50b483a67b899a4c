"""`inhabit bench box`: cost of a control step with a box in hand, by contact settings."""

import copy
import time
from collections.abc import Sequence
from dataclasses import replace

import mujoco
import torch

import pretrained
from console.bench.turns import turns
from console.run import assembly
from policy.model.acting import Policy
from world import random_streams, tasks
from world.character import model as character
from world.config import CarryConfig, WorldConfig
from world.objects import grasp
from world.objects.box_bank import BoxBank, boxes, resting
from world.scene.batch import Scenes
from world.scene.target import Target
from world.tasks.carry import Carry, grips

#: Control steps between two resets: long enough for first steps with the box.
_EPISODE = 45
#: Distance of the target ahead, m.
_WAY_M = 4.0
_CONE, _MATRIX = mujoco.mjtCone, mujoco.mjtJacobian
#: Friction cone and Jacobian of the settings to compare with.
_HOW = {
    "dense": (_CONE.mjCONE_ELLIPTIC, _MATRIX.mjJAC_DENSE),
    "pyramidal": (_CONE.mjCONE_PYRAMIDAL, _MATRIX.mjJAC_SPARSE),
}


def measure(scenes: int, seconds: float, threads: int = 1) -> dict[str, float]:
    """Return control steps/s of characters with boxes of all sizes in hand, and time ratios to
    other contact settings, which step the same states in turn; physics alone.

    held: fraction of the steps after which both hands hold the box. Gaps: largest median difference
    of joint velocities after a step.
    """
    bank = BoxBank(boxes(CarryConfig(sizes=scenes)))
    carriers = _Carriers(bank, threads)
    others = {name: _like(bank.models, *how, threads) for name, how in _HOW.items()}
    taken = dict.fromkeys((*others, "ours"), 0.0)
    apart = dict.fromkeys(others, 0.0)
    steps, held = 0, 0.0
    for step in turns(seconds, 2 * _EPISODE):
        if step % _EPISODE == 0:
            carriers.reset()
        carriers.aim()
        before = carriers.scenes.physics()
        for name, other in others.items():
            other.load_physics(before)
            taken[name] += _step(other)
        taken["ours"] += _step(carriers.scenes)
        for name, other in others.items():
            gap = (other.qvel - carriers.scenes.qvel)[:, 6:].abs()
            apart[name] = max(apart[name], float(gap.median()))
        held += carriers.held()
        steps = step + 1
    ours = taken["ours"]
    return {
        "control_steps_per_s": steps * scenes / ours,
        "us_per_step": 1e6 * ours / (steps * scenes),
        "held_ratio": held / steps,
        "to_dense_time_ratio": ours / taken["dense"],
        "to_pyramidal_time_ratio": ours / taken["pyramidal"],
        "to_dense_gap_rad_per_s": apart["dense"],
        "to_pyramidal_gap_rad_per_s": apart["pyramidal"],
    }


def _like(
    models: Sequence[mujoco.MjModel],
    cone: mujoco.mjtCone,
    matrix: mujoco.mjtJacobian,
    threads: int,
) -> Scenes:
    """Return scenes of the same models with other contact settings."""
    others = [copy.copy(model) for model in models]
    for model in others:
        model.opt.cone, model.opt.jacobian = cone, matrix
    return _scenes(others, threads)


def _scenes(models: Sequence[mujoco.MjModel], threads: int) -> Scenes:
    world = WorldConfig()
    return Scenes(models, world.action_scale, world.action_clip, threads)


def _step(scenes: Scenes) -> float:
    """Step the physics by one control step; return its wall time, s."""
    start = time.perf_counter()
    scenes.batch.step(nstep=character.SUBSTEPS)
    return time.perf_counter() - start


class _Carriers:
    """Scenes in which the package's policy carries a box, of one size each, from standing."""

    def __init__(self, bank: BoxBank, threads: int) -> None:
        n = len(bank)
        self.scenes = _scenes(bank.models, threads)
        self._bank, self._ids, self._task = bank, torch.arange(n), Carry()
        self._policy = Policy(assembly.trained(pretrained.ROOT / "carry").weights)
        self._target: Target | None = None
        self._turn = 0

    def reset(self) -> None:
        """Reset to standing with the box in hand, its stand behind, the target ahead."""
        n, bank = len(self._ids), self._bank
        qpos = torch.from_numpy(character.standing_qpos()).float()[None].repeat(n, 1)
        ahead = torch.tensor([[1.0, 0.0]]).repeat(n, 1)
        at = grasp.held_centre(qpos[:, :3], ahead, bank.half[:, 0])
        u = random_streams.uniform(0, random_streams.EPISODE, self._ids, self._turn, 2)
        target = torch.cat((_WAY_M * ahead + u - 0.5, at[:, 2:]), dim=1)
        behind = at - 2.0 * _WAY_M * torch.cat((ahead, torch.zeros(n, 1)), dim=1)
        layout = replace(resting(at, ahead, target), start=behind)
        self._target = bank.target(self._ids, layout)
        assert self._target.box is not None
        qpos = grasp.holding_pose(qpos, self._target.box)
        none = torch.zeros(n, character.NV)
        self.scenes.set_state(self._ids, qpos, none, layout.start, layout.start_yaw)
        bank.apply(self.scenes, self._ids, self._ids, layout)
        self._turn += 1

    def aim(self) -> None:
        """Set the servos' set-points to the policy's."""
        assert self._target is not None
        now, body = self.scenes.now(self._target), self.scenes.body()
        goal = self._task.goal_features(body, now)
        self.scenes.aim(self._policy(tasks.state(body, now), goal))

    def held(self) -> float:
        """Return the fraction of the scenes with both hands on the box."""
        assert self._target is not None
        box = self.scenes.now(self._target).box
        assert box is not None
        return float(grips(self.scenes.body(), box).float().mean())
